"""proto/reference.py: the whole contract is on its page, with a comment for everything; what has none is found, and what
a request may carry without bound, and calls that do not say who may make them."""

import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

PROTO = Path(__file__).resolve().parents[2] / "proto"
sys.path.insert(0, str(PROTO))
import reference  # noqa: E402 - needs the path above

SMALL = '''syntax = "proto3";
package axisd.v1;

// Says where things are.
service PlaceService {
  // Answers at once,
  // with a `Place` & more.
  rpc GetPlace(GetPlaceRequest) returns (stream GetPlaceResponse);
}
message GetPlaceRequest {
  string axis = 1;
}
message GetPlaceResponse {
  repeated Place places = 1;
}
// One place.
message Place {
  oneof kind {
    // In mm.
    double position = 1;
    // Of a node.
    Side side = 2;
  }
  // Where it is in a cell.
  message Cell {
    // Counts from 1.
    optional uint32 row = 1;
  }
  Cell cell = 3;
}
// Which side.
enum Side {
  SIDE_UNSPECIFIED = 0;
  // The left one.
  SIDE_LEFT = 1;
}
'''

BOUNDED = '''syntax = "proto3";
package axisd.v1;
import "axisd/v1/bounds.proto";
import "google/protobuf/field_mask.proto";

service PlaceService {
  rpc GetPlace(GetPlaceRequest) returns (GetPlaceResponse);
}
message GetPlaceRequest {
  string axis = 1 [(bounds).max_bytes = 64];
  repeated Cell cells = 2 [(bounds).max_items = 8];
  google.protobuf.FieldMask fields = 3 [(bounds) = {max_items: 9, max_bytes: 10}];
  repeated string names = 4 [(bounds) = {max_items: 11, max_bytes: 12, tolerated: true}];
}
message GetPlaceResponse {
  repeated string axes = 1;
}
message Cell {
  oneof content {
    bytes data = 1 [(bounds).max_bytes = 7];
  }
}
'''


def descriptors(folder, package="axisd/v1"):
    with tempfile.NamedTemporaryFile() as out:
        files = sorted(path.relative_to(folder) for path in folder.glob(f"{package}/*.proto"))
        subprocess.run(["protoc", f"-I{folder}", "--include_source_info", "--include_imports",
                        f"--descriptor_set_out={out.name}", *files], cwd=folder, check=True)
        return Path(out.name).read_bytes()


class ContractOfTheCell(unittest.TestCase):
    def setUp(self):
        reference.PACKAGE, before = ".axisd.cell.v1.", reference.PACKAGE
        self.addCleanup(setattr, reference, "PACKAGE", before)
        self.files = reference.read(descriptors(PROTO, "axisd/cell/v1"))

    def test_everything_has_a_comment_a_bound_and_a_role(self):
        self.assertEqual([file.name for file in self.files], ["axisd/cell/v1/cell_service.proto"])
        for look in (reference.missing, reference.unbounded, reference.without_role):
            self.assertEqual(list(look(self.files)), [])

    def test_links_lead_somewhere(self):
        page = reference.page(self.files)
        shown = set(re.findall(r'id="([^"]+)"', page))
        self.assertEqual(set(re.findall(r'href="#([^"]+)"', page)) - shown, set())
        self.assertIn("CellService.StopAll", shown)


class Contract(unittest.TestCase):
    def test_everything_has_a_comment(self):
        self.assertEqual(list(reference.missing(reference.read(descriptors(PROTO)))), [])

    def test_every_request_is_bounded(self):
        self.assertEqual(list(reference.unbounded(reference.read(descriptors(PROTO)))), [])

    def test_every_call_says_who_may_make_it(self):
        self.assertEqual(list(reference.without_role(reference.read(descriptors(PROTO)))), [])

    def test_everything_is_on_the_page(self):
        page = reference.page(reference.read(descriptors(PROTO)))
        shown = set(re.findall(r'id="([^"]+)"', page))
        wanted, scope = set(), []
        text = "\n".join(path.read_text() for path in PROTO.glob("axisd/v1/*.proto"))
        # An option is told with the fields that have it.
        for line in re.sub(r"(?ms)^extend .*?^}$", "", text).splitlines():
            # Not by the descriptors again: as one reads it.
            line = line.split("//")[0].strip()
            if opened := re.match(r"(message|enum|service|oneof) (\w+) \{(\})?", line):
                if opened[1] != "oneof":
                    wanted.add(".".join([*scope, opened[2]]))
                if not opened[3]:
                    scope.append(opened[2] if opened[1] != "oneof" else "")
            elif line == "}":
                scope.pop()
            elif element := re.match(r"rpc (\w+)\(|(?:[\w.]+ )*([\w]+) = \d+(?: \[.*\])?;", line):
                wanted.add(".".join([*filter(None, scope), element[1] or element[2]]))
                if line.endswith("{"):  # with options
                    scope.append("")
        self.assertGreater(len(wanted), 600)
        self.assertEqual(wanted - shown, set())
        links = set(re.findall(r'href="#([^"]+)"', page))
        self.assertEqual(links - shown, set(), "links that lead nowhere")


GUARDED = '''syntax = "proto3";
package axisd.v1;
import "axisd/v1/access.proto";

service PlaceService {
  rpc GetPlace(GetPlaceRequest) returns (GetPlaceResponse) {
    option (access).role = ROLE_VIEWER;
  }
  rpc KeepPlace(KeepPlaceRequest) returns (KeepPlaceResponse) {
    option (access) = {role: ROLE_OPERATOR, anywhere: true};
  }
}
message GetPlaceRequest {
  string axis = 1;
  bool all = 2 [(needs) = ROLE_MAINTAINER];
}
message GetPlaceResponse {}
message KeepPlaceRequest {}
message KeepPlaceResponse {}
'''


class Small(unittest.TestCase):
    def read(self, text):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "axisd" / "v1" / "place.proto"
            path.parent.mkdir(parents=True)
            path.write_text(text)
            for name in ("access.proto", "bounds.proto"):
                shutil.copy(PROTO / "axisd" / "v1" / name, path.parent)
            return reference.read(descriptors(Path(folder)))

    def test_the_page(self):
        files = self.read(SMALL)
        self.assertEqual(list(reference.missing(files)), [])
        page = reference.page(files)
        for part in ('Answers at once, with a <code><a href="#Place">Place</a></code> &amp; more.',
                     '<h4 id="GetPlaceResponse">stream GetPlaceResponse</h4>', 'id="Place.Cell.row"',
                     '<span class="choice">one of kind</span>', 'optional uint32', "Name of the axis.",
                     'repeated <a href="#Place">Place</a>'):
            self.assertIn(part, page)

    def test_each_missing_comment_is_found(self):
        for comment, name in (("// Says where things are.", "PlaceService"),
                              ("  // Answers at once,\n  // with a `Place` & more.\n", "PlaceService.GetPlace"),
                              ("// One place.", "Place"), ("// In mm.", "Place.position"),
                              ("// Counts from 1.", "Place.Cell.row"), ("// Which side.", "Side"),
                              ("// The left one.", "Side.SIDE_LEFT")):
            self.assertEqual(list(reference.missing(self.read(SMALL.replace(comment, "")))), [name])

    def test_bounds_are_on_the_page(self):
        page = reference.page(self.read(BOUNDED))
        for part in ('At most 64 bytes.', 'At most 8 entries.', 'At most 9 entries of 10 bytes each.',
                     'At most 11 entries of 12 bytes each. What is longer is as if it had not been given.',
                     'In requests: at most 7 bytes.'):
            self.assertIn(part, page)

    def test_each_missing_bound_is_found(self):
        self.assertEqual(list(reference.unbounded(self.read(BOUNDED))), [])
        for bound, name in ((" [(bounds).max_bytes = 64]", "GetPlaceRequest.axis: max_bytes"),
                            (" [(bounds).max_items = 8]", "GetPlaceRequest.cells: max_items"),
                            ("max_items: 9, ", "GetPlaceRequest.fields: max_items"),
                            ("max_bytes: 10", "GetPlaceRequest.fields: max_bytes"),
                            ("max_items: 11, ", "GetPlaceRequest.names: max_items"),
                            ("max_bytes: 12, ", "GetPlaceRequest.names: max_bytes"),
                            (" [(bounds).max_bytes = 7]", "Cell.data: max_bytes")):
            self.assertEqual(list(reference.unbounded(self.read(BOUNDED.replace(bound, "")))), [name])


    def test_roles_are_on_the_page(self):
        page = reference.page(self.read(GUARDED))
        for part in ("Needs the role viewer on each axis that it names.",
                     "Needs the role operator on the machine or on any axis.",
                     "With it, the call needs the role maintainer."):
            self.assertIn(part, page)

    def test_each_missing_role_is_found(self):
        self.assertEqual(list(reference.without_role(self.read(GUARDED))), [])
        for option, name in (("    option (access).role = ROLE_VIEWER;\n", "PlaceService.GetPlace"),
                             ("role: ROLE_OPERATOR, ", "PlaceService.KeepPlace")):
            self.assertEqual(list(reference.without_role(self.read(GUARDED.replace(option, "")))), [name])


if __name__ == "__main__":
    unittest.main()
