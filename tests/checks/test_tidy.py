"""Can the check with clang-tidy fail, and does ccache remember only what was found clean?"""

import subprocess
import tempfile
import unittest
from pathlib import Path

import tidy

LONG = "int sum_of(int a) {\n" + "  a += 1;\n" * 70 + "  return a;\n}\n"


class Tidy(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.told = tidy.environment(tidy.WHOLE_OPTIONS) | {"CCACHE_DIR": str(self.folder / "cache"),
                                                            "CCACHE_BASEDIR": str(self.folder)}
        (self.folder / ".clang-tidy").write_text((tidy.ROOT / ".clang-tidy").read_text())

    def found_in(self, text):
        source = self.folder / "source.cpp"
        source.write_text(text)
        command = (str(self.folder), ["clang++-19", "-std=c++23", "-o", "x.o", "-c", str(source)])
        return tidy.check("source.cpp", command, self.told, self.folder)

    def remembered(self):
        said = subprocess.run(["ccache", "--print-stats"], env=self.told, capture_output=True, text=True, check=True).stdout
        return sum(int(line.split()[1]) for line in said.splitlines()
                   if line.startswith(("direct_cache_hit", "preprocessed_cache_hit")))

    def test_a_long_function(self):
        declared = "int sum_of(int);\n" + LONG
        for _ in range(2):
            found = self.found_in(declared)
            self.assertIn("readability-function-size", found)
            self.assertTrue(found.endswith("tidy: source.cpp has findings"), found)
            self.assertNotIn("generated.", found)
        self.assertEqual(self.found_in(declared.replace("int a) {", "int a) {  // NOLINT(readability-function-size)")), "")
        self.assertIn("readability-function-size", self.found_in(declared))

    def test_a_function_that_nobody_declared(self):
        self.assertIn("missing-prototypes", self.found_in("int one() { return 1; }\n"))
        for text in ("static int one() { return 1; }\nint two();\nint two() { return one(); }\n",
                     "namespace { int one() { return 1; } }\nint two();\nint two() { return one(); }\n"):
            before = self.remembered()
            for _ in range(2):
                self.assertEqual(self.found_in(text), "")
            self.assertEqual(self.remembered(), before + 1)

    def test_a_file_that_is_no_cpp(self):
        self.assertIn("expected", self.found_in("int one(\n"))


if __name__ == "__main__":
    unittest.main()
