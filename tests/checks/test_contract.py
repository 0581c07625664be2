"""contract.sh and proto/release.sh on a small contract of their own: a break is found, also behind a new baseline."""

import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CONTRACT = '''syntax = "proto3";

package axisd.v1;

// Where an axis is.
message Place {
  // In mm.
  double position = 1;
  // In mm/s.
  double velocity = 2;
}
'''


class Contract(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.tree = Path(folder.name)
        for name in ("tests/checks/contract.sh", "proto/release.sh", "proto/buf.yaml"):
            (self.tree / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, self.tree / name)
        (self.tree / "node_modules").symlink_to(ROOT / "node_modules")
        (self.tree / "proto/axisd/v1").mkdir(parents=True)
        self.proto = self.tree / "proto/axisd/v1/place.proto"
        self.git("init", "-q")
        self.change(CONTRACT)
        self.write_baseline()
        self.commit()

    def git(self, *words):
        subprocess.run(["git", "-C", self.tree, "-c", "user.name=t", "-c", "user.email=t@t", *words], check=True,
                       stdout=subprocess.DEVNULL)

    def commit(self):
        self.git("add", "proto", "tests")
        self.git("commit", "-q", "-m", "a change")

    def change(self, text):
        self.proto.write_text(text, encoding="utf-8")

    def write_baseline(self):
        buf = next(ROOT.glob("node_modules/@bufbuild/buf-linux-*/bin/buf"))
        subprocess.run([buf, "build", "proto", "-o", "proto/baseline.binpb"], cwd=self.tree, check=True)

    def run_script(self, name):
        done = subprocess.run([self.tree / name], capture_output=True, text=True, check=False)
        return done.returncode, done.stdout + done.stderr

    def expect(self, script, said):
        status, text = self.run_script(script)
        self.assertEqual((status != 0, said in text), (bool(said), True), text)

    def test_additions_pass_and_breaks_do_not(self):
        self.expect("tests/checks/contract.sh", "")
        self.change(CONTRACT.replace("}", "  // Its name.\n  string name = 3;\n}"))
        self.expect("tests/checks/contract.sh", "")
        self.change(CONTRACT.replace("double velocity", "float velocity"))
        self.expect("tests/checks/contract.sh", 'changed type from "double" to "float"')

    def test_what_was_released_stays(self):
        grown = CONTRACT.replace("}", "  // Its name.\n  string name = 3;\n}")
        self.change(grown)
        self.commit()
        self.expect("proto/release.sh", "")
        self.commit()
        self.change(CONTRACT)
        self.expect("tests/checks/contract.sh", 'Previously present field "3"')

    def test_a_release_does_not_hide_a_break(self):
        self.change(CONTRACT.replace("  double velocity = 2;\n", ""))
        self.expect("proto/release.sh", "not committed")
        self.commit()
        self.expect("proto/release.sh", 'Previously present field "2"')

    def test_a_baseline_written_by_hand_does_not_hide_a_break(self):
        self.change(CONTRACT.replace("  double velocity = 2;\n", ""))
        self.write_baseline()
        self.expect("tests/checks/contract.sh", 'Previously present field "2"')
        self.commit()
        self.expect("tests/checks/contract.sh", 'Previously present field "2"')

    def test_lint_is_part_of_it(self):
        self.change(CONTRACT.replace("velocity", "Velocity"))
        self.expect("tests/checks/contract.sh", "lower_snake_case")


if __name__ == "__main__":
    unittest.main()
