"""Writes the reference documentation of the API: one HTML page with everything that proto/ says, from its comments.

    reference.py DESCRIPTORS PAGE [--package axisd.cell.v1] [--check]

DESCRIPTORS: protoc --include_source_info --include_imports --descriptor_set_out=DESCRIPTORS axisd/v1/*.proto
--package: what the page is about; else axisd.v1. Types of other packages are named without a link.
--check: an error if anything is not described, a field of a request has no bound (bounds.proto), or a call no role
(access.proto). What speaks for itself needs no comment: a request or response (its RPC says it), the zero of an enum, a field whose type is one of ours
(that is described), and the names in OBVIOUS.
"""
import argparse
import dataclasses
import html
import pathlib
import re
import sys

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

OBVIOUS = {
    "at": "When.",
    "axis": "Name of the axis.",
    "bus": "Name of the bus.",
    "client": "Identity of the client.",
    "code": "Number.",
    "command_id": "Id of the command.",
    "group": "Name of the group.",
    "id": "Id of the command.",
    "model": "Name of the drive's model.",
    "name": "Its name.",
    "node": "Modbus unit or CANopen node-ID.",
    "simulated": "It is a simulated one.",
    "unit": "Unit of its values.",
    "velocity": "User units per second.",
    "version": "Version.",
}
UNSPECIFIED = "Not said."
SCALARS = {number: name.removeprefix("TYPE_").lower()
           for name, number in descriptor_pb2.FieldDescriptorProto.Type.items()}
#: Package -> what its page begins with.
INTRODUCTIONS = {
    "axisd.v1": """The API of axisd, generated from the comments of <code>proto/axisd/v1</code>. Values are in the unit of their axis,
velocities per second. The gRPC status speaks of the call; what became of a motion is in <a href="#Command">Command</a>.
Errors carry an <a href="#ErrorDetail">ErrorDetail</a> in the trailer <code>grpc-status-details-bin</code>, with what to do.""",
    "axisd.cell.v1": """The API of a cell, generated from the comments of <code>proto/axisd/cell/v1</code>: what an entrance
serves itself. Everything else it passes on to a machine, whose API is <a href="api.html">axisd.v1</a>.""",
}
PACKAGE = ".axisd.v1."  # of the page

# Numbers of fields in descriptor.proto, of which the paths of comments are made.
FILE_MESSAGE, FILE_ENUM, FILE_SERVICE = 4, 5, 6
MESSAGE_FIELD, MESSAGE_NESTED, MESSAGE_ENUM = 2, 3, 4
ENUM_VALUE, SERVICE_METHOD = 2, 2


@dataclasses.dataclass
class Bounds:
    """How much a field of a request may carry (bounds.proto). 0: it does not say."""
    items: int = 0
    bytes: int = 0
    tolerated: bool = False


@dataclasses.dataclass
class Access:
    """Who may make a call (access.proto). "": it does not say."""
    role: str = ""
    anywhere: bool = False


@dataclasses.dataclass
class Row:
    """A field or a value."""
    name: str
    type: str
    number: int
    text: str
    choice: str = ""  # the oneof that it is part of
    bounds: Bounds = dataclasses.field(default_factory=Bounds)
    needs: str = ""  # the role that a request with it needs


@dataclasses.dataclass
class Type:
    """A message or an enum. `kind`: "message" or "enum"."""
    name: str
    kind: str
    text: str
    rows: list[Row]


@dataclasses.dataclass
class Method:
    name: str
    request: str
    response: str
    streams: bool
    text: str
    access: Access


@dataclasses.dataclass
class Service:
    name: str
    text: str
    methods: list[Method]


@dataclasses.dataclass
class File:
    name: str
    services: list[Service]
    types: list[Type]


class Reader:
    """One file of the descriptor set."""

    def __init__(self, file, options):
        self._options = options
        self._comments = {tuple(place.path): place.leading_comments for place in file.source_code_info.location}
        self.file = File(file.name, [], [])
        for index, service in enumerate(file.service):
            self.file.services.append(self._service(service, (FILE_SERVICE, index)))
        for index, message in enumerate(file.message_type):
            self._message(message, (FILE_MESSAGE, index), "")
        for index, enum in enumerate(file.enum_type):
            self._enum(enum, (FILE_ENUM, index), "")

    def _text(self, path):
        return re.sub(r"(?m)^ ", "", self._comments.get(path, "")).strip()

    def _service(self, service, path):
        methods = [Method(method.name, method.input_type, method.output_type, method.server_streaming,
                          self._text((*path, SERVICE_METHOD, index)), self._options.access(method))
                   for index, method in enumerate(service.method)]
        return Service(service.name, self._text(path), methods)

    def _message(self, message, path, outer):
        rows = []
        for index, field in enumerate(message.field):
            label = "repeated " if field.label == field.LABEL_REPEATED else "optional " if field.proto3_optional else ""
            choice = ""
            if field.HasField("oneof_index") and not field.proto3_optional:
                choice = message.oneof_decl[field.oneof_index].name
            rows.append(Row(field.name, label + (field.type_name or SCALARS[field.type]), field.number,
                            self._text((*path, MESSAGE_FIELD, index)), choice, self._options.bounds(field),
                            self._options.needs(field)))
        self.file.types.append(Type(outer + message.name, "message", self._text(path), rows))
        for index, nested in enumerate(message.nested_type):
            self._message(nested, (*path, MESSAGE_NESTED, index), f"{outer}{message.name}.")
        for index, enum in enumerate(message.enum_type):
            self._enum(enum, (*path, MESSAGE_ENUM, index), f"{outer}{message.name}.")

    def _enum(self, enum, path, outer):
        rows = [Row(value.name, "", value.number, self._text((*path, ENUM_VALUE, index)))
                for index, value in enumerate(enum.value)]
        self.file.types.append(Type(outer + enum.name, "enum", self._text(path), rows))


class Options:
    """The options of fields and calls. They are known from the files alone, not from generated code."""

    def __init__(self, files):
        self._pool = descriptor_pool.DescriptorPool()
        for file in files:
            self._pool.Add(file)
        self._types = message_factory.MessageFactory(self._pool).GetMessages([file.name for file in files])

    def _value(self, one, kind, name):
        """An option of axisd.v1; None: there is no such option, or it is not said."""
        try:
            extension = self._pool.FindExtensionByName(f"axisd.v1.{name}")
        except KeyError:
            return None
        found = self._types[f"google.protobuf.{kind}"].FromString(one.options.SerializeToString())
        return found.Extensions[extension] if found.HasExtension(extension) else None

    def _role(self, number):
        name = self._pool.FindEnumTypeByName("axisd.v1.Role").values_by_number[number].name
        return "" if number == 0 else name.removeprefix("ROLE_").lower()

    def bounds(self, field):
        found = self._value(field, "FieldOptions", "bounds")
        return Bounds() if found is None else Bounds(found.max_items, found.max_bytes, found.tolerated)

    def needs(self, field):
        found = self._value(field, "FieldOptions", "needs")
        return "" if found is None else self._role(found)

    def access(self, method):
        found = self._value(method, "MethodOptions", "access")
        return Access() if found is None else Access(self._role(found.role), found.anywhere)


def read(descriptors):
    """The files of the package, in the order of their names."""
    files = descriptor_pb2.FileDescriptorSet.FromString(descriptors).file
    options = Options(files)
    return [Reader(file, options).file for file in sorted(files, key=lambda file: file.name)
            if f".{file.package}." == PACKAGE]


def exchanged(name):
    return name.endswith(("Request", "Response"))


def own_type(row):
    """The row's type if it is one of ours, without its package."""
    name = row.type.rpartition(" ")[2]
    return name.removeprefix(PACKAGE) if name.startswith(PACKAGE) else None


def text_of(row, kind):
    """What the page says about a field or a value."""
    if row.text:
        return row.text
    if kind == "enum":
        return UNSPECIFIED if row.number == 0 else ""
    if own_type(row):
        return f"See `{own_type(row)}`."
    return OBVIOUS.get(row.name, "")


def missing(files):
    """Everything that nothing is said about."""
    for file in files:
        for service in file.services:
            if not service.text:
                yield service.name
            yield from (f"{service.name}.{method.name}" for method in service.methods if not method.text)
        for one in file.types:
            if not one.text and not exchanged(one.name):
                yield one.name
            yield from (f"{one.name}.{row.name}" for row in one.rows if not text_of(row, one.kind))


def bounds_text(row):
    """What the page says about how much a field may carry."""
    entries = f"{row.bounds.items} entries" if row.bounds.items else ""
    length = f"{row.bounds.bytes} bytes" if row.bounds.bytes else ""
    if not entries and not length:
        return ""
    said = f"{entries} of {length} each" if entries and length else entries or length
    longer = " What is longer is as if it had not been given." if row.bounds.tolerated and length else ""
    return f"At most {said}.{longer}"


def unbounded(files):
    """Every repeated field, string and bytes of a request that may carry any amount."""
    types = {one.name: one for file in files for one in file.types}
    waiting = [method.request for file in files for service in file.services for method in service.methods]
    seen = set(waiting)
    while waiting:
        one = types[waiting.pop().removeprefix(PACKAGE)]
        for row in one.rows:
            base = row.type.rpartition(" ")[2]
            if row.type.startswith("repeated ") and not row.bounds.items:
                yield f"{one.name}.{row.name}: max_items"
            if base in ("string", "bytes", ".google.protobuf.FieldMask") and not row.bounds.bytes:
                yield f"{one.name}.{row.name}: max_bytes"
            if base == ".google.protobuf.FieldMask" and not row.bounds.items:
                yield f"{one.name}.{row.name}: max_items"
            if base.startswith(PACKAGE) and base not in seen and types[base.removeprefix(PACKAGE)].kind == "message":
                seen.add(base)
                waiting.append(base)


def without_role(files):
    """Every call of which nothing is said who may make it."""
    for file in files:
        for service in file.services:
            yield from (f"{service.name}.{method.name}" for method in service.methods if not method.access.role)


def access_text(method, request):
    """What the page says about who may make a call."""
    role = method.access.role
    if not role:
        return ""
    if role == "none":
        return "Needs no role."
    if method.access.anywhere:
        return f"Needs the role {role} on the machine or on any axis."
    on_axes = any(row.name in ("axis", "axes", "group") for row in request.rows)
    return f"Needs the role {role}{' on each axis that it names' if on_axes else ''}."


class Page:
    """The page as it grows."""

    def __init__(self, files):
        self.files = files
        self.types = {one.name: one for file in files for one in file.types}
        self.parts = []

    def link(self, name):
        """A type as it is written, with a link if it is described here."""
        label, _, base = name.rpartition(" ")
        short = base.removeprefix(PACKAGE).removeprefix(".google.protobuf.")
        text = html.escape(short)
        if base.startswith(PACKAGE):
            text = f'<a href="#{text}">{text}</a>'
        return f"{label} {text}".strip()

    def prose(self, text):
        """A comment as paragraphs, with code and links where it names types."""
        paragraphs = []
        for paragraph in re.split(r"\n\s*\n", text):
            escaped = html.escape(" ".join(paragraph.split()), quote=False)
            escaped = re.sub(r"`([^`]+)`", r"<code>\1</code>", escaped)
            paragraphs.append(re.sub(r"\b[A-Z][A-Za-z]+\b", self._linked, escaped))
        return "<p>".join(paragraphs)

    def _linked(self, match):
        return f'<a href="#{match[0]}">{match[0]}</a>' if match[0] in self.types else match[0]

    def table(self, one):
        if not one.rows:
            return '<p class="empty">Without fields.</p>'
        lines = []
        for row in one.rows:
            choice = f' <span class="choice">one of {html.escape(row.choice)}</span>' if row.choice else ""
            type_cell = f"<td class=type>{self.link(row.type)}{choice}</td>" if one.kind == "message" else ""
            bounds = bounds_text(row)
            if bounds and not one.name.endswith("Request"):
                bounds = f"In requests: {bounds[0].lower()}{bounds[1:]}"
            if row.needs:
                bounds = f"{bounds} With it, the call needs the role {row.needs}.".strip()
            bounds = f' <span class="bounds">{bounds}</span>' if bounds else ""
            lines.append(f'<tr id="{one.name}.{row.name}"><td class=name>{row.name}</td>{type_cell}'
                         f"<td class=number>{row.number}</td><td>{self.prose(text_of(row, one.kind))}{bounds}</td></tr>")
        return f"<table>{''.join(lines)}</table>"

    def method(self, service, method):
        request, response = (name.removeprefix(PACKAGE) for name in (method.request, method.response))
        stream = "stream " if method.streams else ""
        self.parts.append(
            f'<section class=method><h3 id="{service.name}.{method.name}">{method.name}</h3>'
            f"<p>{self.prose(method.text)}</p>"
            f'<p class="access">{access_text(method, self.types[request])}</p>'
            f'<h4 id="{request}">{request}</h4>{self.table(self.types[request])}'
            f'<h4 id="{response}">{stream}{response}</h4>{self.table(self.types[response])}</section>')

    def type(self, one):
        self.parts.append(f'<section><h3 id="{one.name}">{one.kind} {one.name}</h3>'
                          f"<p>{self.prose(one.text)}</p>{self.table(one)}</section>")

    def body(self):
        shown = {name.removeprefix(PACKAGE) for file in self.files for service in file.services
                 for method in service.methods for name in (method.request, method.response)}
        for file in self.files:
            for service in file.services:
                self.parts.append(f'<h2 id="{service.name}">{service.name}</h2><p>{self.prose(service.text)}</p>')
                for method in service.methods:
                    self.method(service, method)
            rest = [one for one in file.types if one.name not in shown]
            if rest:
                self.parts.append(f'<h2 id="{file.name}">Types of {file.name}</h2>')
            for one in rest:
                self.type(one)
        return "\n".join(self.parts)

    def navigation(self):
        lines = []
        for file in self.files:
            for service in file.services:
                methods = "".join(f'<li><a href="#{service.name}.{method.name}">{method.name}</a></li>'
                                  for method in service.methods)
                lines.append(f'<li><a href="#{service.name}">{service.name}</a><ul>{methods}</ul></li>')
        types = "".join(f'<li><a href="#{name}">{name}</a></li>' for name in sorted(self.types) if not exchanged(name))
        return f"<ul>{''.join(lines)}<li>Types<ul>{types}</ul></li></ul>"


TEMPLATE = """<!DOCTYPE html>
<html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{package}</title>
<style>
:root {{ color-scheme: light dark; --line: #8884; --dim: #888; }}
body {{ margin: 0; font: 15px/1.5 system-ui, sans-serif; display: grid; grid-template-columns: 17em minmax(0, 60em); }}
nav {{ position: sticky; top: 0; height: 100vh; overflow: auto; padding: 1em; box-sizing: border-box;
       border-right: 1px solid var(--line); font-size: 13px; }}
nav ul {{ list-style: none; margin: 0; padding-left: 0.8em; }}
nav > ul {{ padding-left: 0; }}
main {{ padding: 0 2em 4em; }}
a {{ color: inherit; text-decoration-color: var(--dim); }}
h2 {{ margin-top: 2.5em; border-bottom: 2px solid var(--line); }}
h3 {{ margin: 2em 0 0.3em; }}
h4 {{ margin: 1em 0 0.3em; font-weight: normal; color: var(--dim); font-family: ui-monospace, monospace; font-size: 13px; }}
table {{ border-collapse: collapse; width: 100%; }}
td {{ border-top: 1px solid var(--line); padding: 0.25em 0.8em 0.25em 0; vertical-align: top; }}
.name, .type, .number, code {{ font-family: ui-monospace, monospace; font-size: 13px; }}
.number, .choice, .bounds, .access, .empty {{ color: var(--dim); }}
.name, .type {{ overflow-wrap: anywhere; min-width: 9em; }}
:target {{ background: #fd06; }}
@media (max-width: 50em) {{ body {{ display: block; }} nav {{ display: none; }} main {{ padding: 0 1em; }} }}
</style>
<nav>{navigation}</nav>
<main><h1>{package}</h1>
<p>{introduction}
{body}</main></html>
"""


def page(files):
    """The whole page."""
    one = Page(files)
    package = PACKAGE.strip(".")
    return TEMPLATE.format(package=package, introduction=INTRODUCTIONS[package], navigation=one.navigation(),
                           body=one.body())


def main():
    parser = argparse.ArgumentParser(description="Writes the reference documentation of the API.")
    parser.add_argument("descriptors", type=pathlib.Path)
    parser.add_argument("page", type=pathlib.Path)
    parser.add_argument("--package", choices=INTRODUCTIONS, default="axisd.v1")
    parser.add_argument("--check", action="store_true", help="an error if anything is not described or bounded, or has no role")
    arguments = parser.parse_args()
    global PACKAGE
    PACKAGE = f".{arguments.package}."
    files = read(arguments.descriptors.read_bytes())
    arguments.page.write_text(page(files), encoding="utf-8")
    silent = list(missing(files)) if arguments.check else []
    for name in silent:
        print(f"reference.py: {name} has no comment", file=sys.stderr)
    open_ended = list(unbounded(files)) if arguments.check else []
    for name in open_ended:
        print(f"reference.py: {name} is missing in its bounds", file=sys.stderr)
    open_to_all = list(without_role(files)) if arguments.check else []
    for name in open_to_all:
        print(f"reference.py: {name} has no role", file=sys.stderr)
    return 1 if silent or open_ended or open_to_all else 0


if __name__ == "__main__":
    sys.exit(main())
