"""The check of manual pages: a good one passes, and each fault is found."""

import tempfile
import unittest
from pathlib import Path

import manuals

PAGE = '.TH X 8 "" "x" "x"\n.SH OPTIONS\n.TP\n\\fB\\-\\-port\\fR \\fIN\\fR\nThe port.\n'


class Manuals(unittest.TestCase):
    def findings(self, page):
        with tempfile.TemporaryDirectory() as folder:
            program = Path(folder) / "x"
            program.write_text("#!/bin/sh\necho '-h, --help  Print help'\necho '--port N  the port'\n")
            program.chmod(0o755)
            path = Path(folder) / "x.8"
            path.write_text(page)
            return manuals.findings(path, str(program))

    def test_a_good_page_passes(self):
        self.assertEqual(self.findings(PAGE + "\\-\\-help\n"), [])

    def test_options_are_compared(self):
        self.assertEqual(self.findings(PAGE.replace("port", "post") + "\\-\\-help\n"),
                         ["x.8: does not name --port", "x.8: names --post, which x does not have"])

    def test_groff_complains(self):
        self.assertIn("NOSUCH", "".join(self.findings(PAGE + "\\-\\-help\n.NOSUCH\n")))


if __name__ == "__main__":
    unittest.main()
