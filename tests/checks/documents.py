"""What the documents promise: each rule of motion that is cited has a heading in docs/rules.md, each rule there has a
test that cites it, and each path that a document cites is in the tree. In rules and glossary, so is each name beside
a path. README.md stays short."""

import fnmatch
import re
import sys
from pathlib import Path

import tree

RULES = "docs/rules.md"
GLOSSARY = "docs/glossary.md"
README = "README.md"
README_LINES = 150
HEADING = re.compile(r"^## M(\d{1,2}) \S", re.MULTILINE)
# "M14", "M06" and "M22Group" are citations; "M90.0 292.2" is a path of a picture.
CITATION = re.compile(r"(?<![\w'\"/.+-])M0?([1-9]\d?)(?![\da-z])(?!\.\d)")
CITING = {".cpp", ".hpp", ".py", ".md", ".sh", ".cmake", ".txt", ".in", ".yaml", ".proto", ".csv", ".ts", ".service"}
TESTS = {".cpp", ".hpp", ".py"}
# These files name rules and paths that there are not.
THIS_CHECK = {"tests/checks/documents.py", "tests/checks/test_checks.py"}

QUOTED = re.compile(r"`([^`\n]+)`")
LINK = re.compile(r"\]\(([^)#\s]+)(#[^)]*)?\)")
NAME = re.compile(r"[A-Za-z_]\w*")
# Part of a path that stands for any.
PLACEHOLDER = re.compile(r"(?<![A-Za-z])(MODEL|NAME|SERVICE|SUBJECT)(?![A-Za-z])")


def line_of(text, position):
    return text.count("\n", 0, position) + 1


def is_document(path):
    name = path.as_posix()
    return name in (README, "CONTRIBUTING.md") or (name.startswith("docs/") and path.suffix == ".md")


class Tree:
    """The names of all files and folders."""

    def __init__(self, paths):
        self.files = {path.as_posix() for path in paths}
        self.folders = {parent.as_posix() for path in paths for parent in path.parents} - {"."}
        self.top = {name for name in self.folders if "/" not in name}

    def looks_like_path(self, word):
        return "/" in word and word.split("/", 1)[0] in self.top

    def matching(self, word):
        """The files that a path, a folder or a pattern means."""
        wanted = PLACEHOLDER.sub("*", word.rstrip("/"))
        if wanted in self.files:
            return [wanted]
        if wanted in self.folders:
            return [name for name in self.files if name.startswith(f"{wanted}/")]
        if "*" not in wanted:
            return []
        # A * stays within one folder, as a shell's does.
        depth = wanted.count("/")
        return [name for name in self.files | self.folders
                if name.count("/") == depth and fnmatch.fnmatchcase(name, wanted)]


def rule_findings(texts):
    """Rules that are cited and not described, described twice, or described and not tested."""
    described = [int(number) for number in HEADING.findall(texts.get(RULES, ""))]
    for number in sorted({number for number in described if described.count(number) > 1}):
        yield f"{RULES}: M{number} has two headings"
    tested = set()
    for name, text in texts.items():
        path = Path(name)
        for match in CITATION.finditer(text):
            number = int(match[1])
            if number not in described:
                yield f"{name}:{line_of(text, match.start())}: M{number} has no heading in {RULES}"
            elif name.startswith("tests/") and not name.startswith("tests/checks/") and path.suffix in TESTS:
                tested.add(number)
    for number in sorted(set(described) - tested):
        yield f"{RULES}: M{number} is cited by no test below tests/"


def path_findings(name, text, known):
    """Paths that are not in the tree: quoted ones from the root, and links from the document's folder."""
    for match in QUOTED.finditer(text):
        for word in match[1].split():
            word = word.rstrip(".,;:)")
            if known.looks_like_path(word) and not known.matching(word):
                yield f"{name}:{line_of(text, match.start())}: there is no {word}"
    folder = Path(name).parent
    for match in LINK.finditer(text):
        if "://" in match[1]:
            continue
        parts = []
        for part in (folder / match[1]).parts:
            if part == "..":
                parts = parts[:-1]
            else:
                parts.append(part)
        target = "/".join(parts)
        if target not in known.files and target not in known.folders:
            yield f"{name}:{line_of(text, match.start())}: there is no {match[1]}"


def items(text):
    """The items of lists, with their first lines' numbers."""
    item, first = [], 0
    for number, line in enumerate([*text.split("\n"), ""], start=1):
        if item and (not line.startswith("  ") or line.startswith("- ")):
            yield first, " ".join(item)
            item = []
        if line.startswith("- "):
            item, first = [line], number
        elif item:
            item.append(line)


def name_findings(name, text, known, texts):
    """Names behind a path that none of the item's files has."""
    for line, item in items(text):
        words = QUOTED.findall(item)
        cited = [file for word in words if known.looks_like_path(word) for file in known.matching(word)]
        if not cited:
            continue
        for word in words:
            if NAME.fullmatch(word) and not any(re.search(rf"\b{word}\b", texts.get(file, "")) for file in cited):
                yield f"{name}:{line}: {word} is in none of the files that are cited with it"


def findings(root):
    paths = tree.files(root)
    known = Tree(paths)
    texts = {}
    for path in paths:
        if path.suffix in CITING and path.as_posix() not in THIS_CHECK:
            texts[path.as_posix()] = tree.text(root, path) or ""
    found = list(rule_findings(texts))
    lines = texts.get(README, "").count("\n")
    if lines > README_LINES:
        found.append(f"{README}:{README_LINES + 1}: {lines} lines, at most {README_LINES}: move something to docs/")
    for name, text in texts.items():
        if is_document(Path(name)):
            found += path_findings(name, text, known)
            if name in (RULES, GLOSSARY):
                found += name_findings(name, text, known, texts)
    return found


if __name__ == "__main__":
    sys.exit(tree.report(findings(Path(sys.argv[1])), "documents"))
