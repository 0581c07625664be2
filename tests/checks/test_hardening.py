"""The check of hardened programs: one that has everything passes, and what one lacks is found.

    tests/checks/test_hardening.py COMPILER
"""

import pathlib
import platform
import subprocess
import sys
import tempfile
import unittest

import hardening

COMPILER = sys.argv.pop(1)
SOURCE = """#include <cstring>
int main(int, char** words) {
  char copy[64];
  std::strncpy(copy, words[0], sizeof copy - 1);
  return copy[0] == 'x';
}
"""
FLAGS = {
    "relro": ["-Wl,-z,relro"],
    "now": ["-Wl,-z,now"],
    "pie": ["-fPIE", "-pie"],
    "stack_protector": ["-fstack-protector-strong"],
    "landing_pads": ["-fcf-protection=full"],
    "shstk": ["-Wl,-z,shstk"],
}
WITHOUT = {
    "relro": ["-Wl,-z,norelro"],
    "now": ["-Wl,-z,lazy"],
    "pie": ["-fno-PIE", "-no-pie"],
    "stack_protector": ["-fno-stack-protector"],
    "landing_pads": ["-fcf-protection=none"],
    "shstk": [],
}


def promises():
    """Those of the last two only processors of one kind have."""
    return [name for name in FLAGS if platform.machine() == "x86_64" or name not in ("landing_pads", "shstk")]


class Hardening(unittest.TestCase):
    def build(self, without):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        source = pathlib.Path(directory.name) / "main.cpp"
        source.write_text(SOURCE)
        program = source.with_suffix("")
        flags = [flag for name in promises() for flag in (WITHOUT if name == without else FLAGS)[name]]
        subprocess.run([COMPILER, "-O1", "-fuse-ld=lld-19", *flags, str(source), "-o", str(program)], check=True)
        return program

    def test_a_program_with_everything_passes(self):
        self.assertEqual(hardening.findings(self.build(None), promises()), [])

    def test_what_a_program_lacks_is_found(self):
        for without in promises():
            with self.subTest(without=without):
                program = self.build(without)
                self.assertEqual(hardening.findings(program, promises()),
                                 [f"{program}: {hardening.CHECKS[without][0]}"])

    def test_what_is_not_promised_may_be_missing(self):
        self.assertEqual(hardening.findings(self.build("relro"), ["pie"]), [])


if __name__ == "__main__":
    unittest.main()
