"""Classes of the product with more than 20 data members: what belongs together belongs into a part that owns it.
Counts names that end in _, laid out by clang-format. Structs are data, and not counted."""

import re
import sys
from pathlib import Path

import tree

MOST = 20
# At most so many: these are to be taken apart.
KNOWN = {
    ("buses/modbus_rtu/rtu_bus.hpp", "RtuBus"): 27,
}

CLASS = re.compile(r"^( *)class (\w+)[^;]*$")
TEMPLATE_ARGUMENTS = re.compile(r"<[^<>]*>")
INITIAL_VALUE = re.compile(r"\{[^{}]*\}| = [^,;]*")
MEMBER = re.compile(r"\b(\w+_)(?:\[\w*\])?\s*[,;]")
NO_MEMBER = re.compile(r"\s*(static|using|friend|typedef|enum|class|struct|template)\b")


def statements(lines, indent):
    """The declarations of a class's body, each on one line; of what has a body of its own, the first line."""
    statement = ""
    for line in lines:
        code = re.sub(r"\s*//.*", "", line).rstrip()
        depth = len(code) - len(code.lstrip())
        if not code or (depth > indent and not statement):
            continue
        statement += code if not statement else " " + code.strip()
        if code.endswith((";", "{", "}", ":")):
            yield statement
            statement = ""


def members(statement):
    """The names of data members that a declaration declares."""
    if not statement.endswith(";") or NO_MEMBER.match(statement):
        return []
    code = statement
    while TEMPLATE_ARGUMENTS.search(code):
        code = TEMPLATE_ARGUMENTS.sub("", code)
    code = INITIAL_VALUE.sub("", code)
    return [] if "(" in code else MEMBER.findall(code)


def classes(text):
    """Name, line and number of data members of each class."""
    lines = text.split("\n")
    for number, line in enumerate(lines):
        found = CLASS.match(re.sub(r"\s*//.*", "", line))
        if not found:
            continue
        indent = len(found[1])
        end = next((last for last in range(number, len(lines)) if lines[last] == f"{found[1]}}};"), None)
        if end is None:
            continue
        body = lines[number + 1:end]
        yield found[2], number + 1, sum(len(members(one)) for one in statements(body, indent + 2))


def findings(root):
    found = []
    for path in tree.files(root):
        if path.suffix not in tree.CODE or path.parts[0] == "tests":
            continue
        for name, line, count in classes(tree.text(root, path) or ""):
            most = KNOWN.get((path.as_posix(), name), MOST)
            if count > most:
                found.append(f"{path}:{line}: {name} has {count} data members, at most {most}: "
                             "give what belongs together to a part that owns it")
    return found


if __name__ == "__main__":
    sys.exit(tree.report(findings(Path(sys.argv[1])), "members"))
