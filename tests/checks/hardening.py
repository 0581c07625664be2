"""Looks into linked programs for what the preset promises (cmake/hardening.cmake).

    tests/checks/hardening.py "relro;now;pie;stack_protector;landing_pads;shstk" PROGRAM...
"""

import pathlib
import re
import shutil
import subprocess
import sys

ENDBR64 = b"\xf3\x0f\x1e\xfa"


class Program:
    """What readelf says of a linked program."""

    def __init__(self, path):
        self.path = pathlib.Path(path)
        readelf = shutil.which("llvm-readelf-19") or shutil.which("readelf")
        if readelf is None:
            sys.exit("hardening.py: no readelf: install llvm-19 (deploy/install-packages.sh test)")
        done = subprocess.run([readelf, "-W", "-l", "-d", "-n", "-s", str(path)], capture_output=True, text=True,
                              check=True)
        self.text = done.stdout

    def has(self, pattern):
        return re.search(pattern, self.text, re.MULTILINE) is not None

    def first_bytes(self, symbol):
        """Of a function; empty if the program has none of that name."""
        found = re.search(rf"^ *\d+: ([0-9a-f]+) +\d+ FUNC .* {symbol}$", self.text, re.MULTILINE)
        if not found:
            return b""
        address = int(found[1], 16)
        for line in re.findall(r"^ +LOAD +(.*)$", self.text, re.MULTILINE):
            offset, start, _, size = (int(word, 16) for word in line.split()[:4])
            if start <= address < start + size:
                with self.path.open("rb") as file:
                    file.seek(address - start + offset)
                    return file.read(len(ENDBR64))
        return b""


CHECKS = {
    "relro": ("no segment GNU_RELRO", lambda program: program.has(r"^ +GNU_RELRO ")),
    "now": ("not bound at its start (BIND_NOW)", lambda program: program.has(r"\(FLAGS_1\).*\bNOW\b")),
    "pie": ("not loaded at random addresses (PIE)", lambda program: program.has(r"\(FLAGS_1\).*\bPIE\b")),
    "stack_protector": ("no call of __stack_chk_fail", lambda program: program.has(r" UND __stack_chk_fail\b")),
    "landing_pads": ("main does not begin with endbr64 (IBT)",
                     lambda program: program.first_bytes("main") == ENDBR64),
    "shstk": ("no note SHSTK", lambda program: program.has(r"x86 feature:.*\bSHSTK\b")),
}


def findings(path, promises):
    """What is promised and missing, a line each."""
    program = Program(path)
    return [f"{path}: {CHECKS[promise][0]}" for promise in promises if not CHECKS[promise][1](program)]


def main():
    promises = [promise for promise in sys.argv[1].split(";") if promise]
    missing = [line for path in sys.argv[2:] for line in findings(path, promises)]
    print("\n".join(missing) or f"{len(sys.argv) - 2} programs keep what is promised: {', '.join(promises) or 'nothing'}")
    return 1 if missing else 0


if __name__ == "__main__":
    sys.exit(main())
