"""proto/reference.py: the whole contract is on its page, with a comment for everything; what has none is found."""

import re
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


def descriptors(folder):
    with tempfile.NamedTemporaryFile() as out:
        files = sorted(path.relative_to(folder) for path in folder.glob("axisd/v1/*.proto"))
        subprocess.run(["protoc", f"-I{folder}", "--include_source_info", "--include_imports",
                        f"--descriptor_set_out={out.name}", *files], cwd=folder, check=True)
        return Path(out.name).read_bytes()


class Contract(unittest.TestCase):
    def test_everything_has_a_comment(self):
        self.assertEqual(list(reference.missing(reference.read(descriptors(PROTO)))), [])

    def test_everything_is_on_the_page(self):
        page = reference.page(reference.read(descriptors(PROTO)))
        shown = set(re.findall(r'id="([^"]+)"', page))
        wanted, scope = set(), []
        for line in "\n".join(path.read_text() for path in PROTO.glob("axisd/v1/*.proto")).splitlines():
            # Not by the descriptors again: as one reads it.
            line = line.split("//")[0].strip()
            if opened := re.match(r"(message|enum|service|oneof) (\w+) \{(\})?", line):
                if opened[1] != "oneof":
                    wanted.add(".".join([*scope, opened[2]]))
                if not opened[3]:
                    scope.append(opened[2] if opened[1] != "oneof" else "")
            elif line == "}":
                scope.pop()
            elif element := re.match(r"rpc (\w+)\(|(?:[\w.]+ )*([\w]+) = \d+;", line):
                wanted.add(".".join([*filter(None, scope), element[1] or element[2]]))
        self.assertGreater(len(wanted), 600)
        self.assertEqual(wanted - shown, set())
        links = set(re.findall(r'href="#([^"]+)"', page))
        self.assertEqual(links - shown, set(), "links that lead nowhere")


class Small(unittest.TestCase):
    def read(self, text):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "axisd" / "v1" / "place.proto"
            path.parent.mkdir(parents=True)
            path.write_text(text)
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


if __name__ == "__main__":
    unittest.main()
