"""The files of the work tree that checks look at."""

import os
import subprocess
import sys
from pathlib import Path

CODE = {".cpp", ".hpp"}
SKIPPED_FOLDERS = {".git", "build", "node_modules", "__pycache__"}


def files(root):
    """Paths relative to `root` of everything that is or could be committed, sorted."""
    listed = subprocess.run(
        ["git", "-c", "safe.directory=*", "-C", str(root), "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        capture_output=True, check=False)
    if listed.returncode == 0:
        names = {os.fsdecode(name) for name in listed.stdout.split(b"\0") if name}
    else:  # an unpacked archive
        names = set()
        for folder, folders, entries in os.walk(root):
            folders[:] = [name for name in folders if name not in SKIPPED_FOLDERS]
            names.update(os.path.relpath(os.path.join(folder, name), root) for name in entries)
    return sorted(Path(name) for name in names if (Path(root) / name).is_file())


def text(root, path):
    """The file's text, or None if it is not text."""
    content = (Path(root) / path).read_bytes()
    if b"\0" in content:
        return None
    return content.decode("utf-8", errors="replace")


def report(findings, what):
    """Prints the findings; the exit status."""
    for finding in findings:
        print(finding)
    print(f"{what}: {len(findings)} finding(s)")
    return 1 if findings else 0


if __name__ == "__main__":  # tree.py ROOT SUFFIX...: the files with one of the suffixes, each ended by a zero byte
    for found in files(sys.argv[1]):
        if found.suffix in sys.argv[2:]:
            sys.stdout.write(f"{found}\0")
