"""clang-tidy; a warning is an error.

    tidy.py BUILD [--since COMMIT | --whole]

BUILD: a folder with compile_commands.json (cmake --preset dev). Default: all checks of .clang-tidy on the C++ files that
differ from where this branch left origin/main, or on main itself those that the last commit and the work tree changed.
--since COMMIT: those that changed since then. --whole: on every file of the product, the checks that are quick: how large
and complex a function is, and functions that no header declares.

ccache remembers which files were found clean (tidy_compiler.sh). AXISD_TIDY_SECONDS (300) bounds the time:
beyond it no further file is begun, and those left out are named; the next run has time for them.
"""

import argparse
import concurrent.futures
import hashlib
import json
import os
import shlex
import shutil
import subprocess
import sys
import time
from pathlib import Path

import tree

ROOT = Path(__file__).resolve().parents[2]
COMPILER = ROOT / "tests/checks/tidy_compiler.sh"
WHOLE_CHECKS = ["readability-function-size", "readability-function-cognitive-complexity",
                "clang-diagnostic-missing-prototypes"]
WHOLE_OPTIONS = [f"--checks=-*,{','.join(WHOLE_CHECKS)}", "--extra-arg=-Wmissing-prototypes"]


def git(*arguments):
    done = subprocess.run(["git", "-c", "safe.directory=*", "-C", ROOT, *arguments], capture_output=True, text=True,
                          check=False)
    return done.stdout.strip() if done.returncode == 0 else ""


def default_start():
    start, head = git("merge-base", "HEAD", "origin/main"), git("rev-parse", "HEAD")
    return start if start not in ("", head) else git("rev-parse", "-q", "--verify", "HEAD~1")


def commands(build):
    """The command that compiles each file of the tree; of a file that several targets have, one."""
    found = {}
    for entry in json.loads((build / "compile_commands.json").read_text()):
        path = Path(entry["file"])
        if path.is_relative_to(ROOT) and not path.is_relative_to(build):
            found.setdefault(path.relative_to(ROOT), (entry["directory"], shlex.split(entry["command"])))
    return found


def environment(options):
    """What clang-tidy is told, and a part of the cache of its own for it."""
    digest = hashlib.sha256(" ".join(options).encode())
    digest.update(subprocess.run(["clang-tidy-19", "--version"], capture_output=True, check=True).stdout)
    for path in [COMPILER, *(ROOT / path for path in tree.files(ROOT) if path.name == ".clang-tidy")]:
        digest.update(path.read_bytes())
    return os.environ | {
        "AXISD_TIDY_OPTIONS": " ".join(options), "CCACHE_NAMESPACE": f"tidy-{digest.hexdigest()[:16]}",
        "CCACHE_COMPILERTYPE": "clang", "CCACHE_COMPILERCHECK": f"string:{digest.hexdigest()}",
        "CCACHE_BASEDIR": str(ROOT), "CCACHE_NOHASHDIR": "1", "CCACHE_SLOPPINESS": "pch_defines,time_macros"}


def check(file, command, told, folder):
    """What clang-tidy finds in the file; empty: nothing."""
    directory, words = command
    output = folder / (str(file).replace("/", "-") + ".o")
    words[words.index("-o") + 1] = str(output)
    launcher = [shutil.which("ccache")] if shutil.which("ccache") else []
    done = subprocess.run([*launcher, COMPILER, *words[1:]], cwd=directory, env=told, capture_output=True, text=True,
                          check=False)
    if done.returncode == 0:
        return ""
    said = [line for line in done.stderr.splitlines() if not line.endswith((" warnings generated.", " warning generated."))]
    return "\n".join([*said, f"tidy: {file} has findings"])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=Path)
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--since", metavar="COMMIT")
    which.add_argument("--whole", action="store_true")
    arguments = parser.parse_args()
    build = arguments.build.resolve()
    if not (build / "compile_commands.json").exists():
        parser.error(f"{build}: no compile_commands.json: configure it first (cmake --preset dev)")
    known, options = commands(build), []
    if arguments.whole:
        files, options = sorted(file for file in known if file.parts[0] != "tests"), WHOLE_OPTIONS
        print(f"tidy: {len(files)} file(s)", flush=True)
    else:
        start = arguments.since or default_start()
        files = [Path(name) for name in git("diff", "--name-only", "--diff-filter=d", start, "--", "*.cpp").splitlines()]
        files = [file for file in files if file in known]
        print(f"tidy: {len(files)} file(s) changed since {start[:8]}", flush=True)
    end = time.monotonic() + float(os.environ.get("AXISD_TIDY_SECONDS", 300))
    folder = build / "tidy"
    folder.mkdir(exist_ok=True)
    told, failed, left_out = environment(options), 0, []

    def one(file):
        return check(file, known[file], told, folder) if time.monotonic() < end else None

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for file, found in zip(files, pool.map(one, files)):
            if found is None:
                left_out.append(str(file))
            elif found:
                failed += 1
                print(found, flush=True)
    if left_out:
        print("tidy: out of time, not checked:", *left_out, sep="\n  ")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
