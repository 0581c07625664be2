"""Manual pages: one that is written by hand names the options that its program has and no others, and groff has no
complaint.

    tests/checks/manuals.py PAGE[=PROGRAM] ...
"""

import re
import subprocess
import sys
from pathlib import Path

import tree

OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]+")
ALWAYS = {"--help", "--now"}  # not every program lists --help; --now is systemctl's


def findings(page, program=None):
    """What is wrong with one page; without a program its options are not looked at."""
    found = []
    if program is not None:
        shown = subprocess.run([program, "--help"], capture_output=True, text=True, check=True).stdout
        text = re.sub(r"\\f.", "", page.read_text(encoding="utf-8")).replace("\\-", "-")
        has, named = set(OPTION.findall(shown)), set(OPTION.findall(text))
        found += [f"{page.name}: does not name {option}" for option in sorted(has - named)]
        found += [f"{page.name}: names {option}, which {Path(program).name} does not have"
                  for option in sorted(named - has - ALWAYS)]
    groff = ["groff", "-man", "-Tutf8", "-ww", "-z", str(page)]
    return found + subprocess.run(groff, capture_output=True, text=True, check=True).stderr.splitlines()


if __name__ == "__main__":
    pages = [word.partition("=") for word in sys.argv[1:]]
    sys.exit(tree.report([finding for page, _, program in pages for finding in findings(Path(page), program or None)],
                         "manuals"))
