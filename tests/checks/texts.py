"""What must not stand in the tree: forbidden words, leftovers, machine paths, generated files, overlong files."""

import re
import sys
from pathlib import Path

import tree

WARN_LINES = 400
MOST_LINES = 600
COUNTED = {".cpp", ".hpp", ".py", ".sh"}

# These files name what they forbid.
THIS_CHECK = {"tests/checks/texts.py", "tests/checks/test_checks.py"}

TEXTS = [
    # No safety rating: a stop of this daemon is operational (IEC 60204-1 category 0 is hard-wired).
    (re.compile(r"\be-?stop(s|ped|ping)?\b|\bsafe(ly)?[ -]stop", re.IGNORECASE), "say stop, halt or quick stop"),
    (re.compile(r"\b(TODO|FIXME|XXX)\b"), "a leftover: do it or drop it"),
    (re.compile(r"(?<![\w.])/(work|root)/|(?<![\w.])/home/\w"), "a path of one machine"),
    (re.compile(r'"resolved"\s*:|https?://[^\s"\'<>]*(registry|artifactory|nexus)', re.IGNORECASE), "a package registry's host"),
    (re.compile(r"^(<{7}|>{7}) ", re.MULTILINE), "a merge conflict"),
]

GENERATED = re.compile(r"\.pb\.(h|cc)$|_pb2(_grpc)?\.pyi?$|\.(o|a|so|d|pyc|profraw|gcda|gcno)$"
                       r"|(^|/)(build|node_modules|__pycache__|CMakeFiles|Testing)/|(^|/)(CMakeCache\.txt|compile_commands\.json)$")


def text_findings(path, text):
    for pattern, why in TEXTS:
        for match in pattern.finditer(text):
            line = text.count("\n", 0, match.start()) + 1
            yield f"{path}:{line}: '{match[0].strip()}': {why}"


def findings(root):
    """Failures, and warnings that do not fail."""
    failures, warnings = [], []
    for path in tree.files(root):
        if GENERATED.search(path.as_posix()):
            failures.append(f"{path}: generated or built: do not commit it")
            continue
        text = tree.text(root, path)
        if text is None:
            continue
        if path.as_posix() not in THIS_CHECK:
            failures += text_findings(path, text)
        if path.suffix in COUNTED:
            lines = text.count("\n")
            if lines > MOST_LINES:
                failures.append(f"{path}: {lines} lines, at most {MOST_LINES}: split it")
            elif lines > WARN_LINES:
                warnings.append(f"{path}: warning: {lines} lines, better below {WARN_LINES}")
    return failures, warnings


if __name__ == "__main__":
    failed, warned = findings(Path(sys.argv[1]))
    print("\n".join(warned))
    sys.exit(tree.report(failed, "texts"))
