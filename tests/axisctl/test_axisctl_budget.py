"""What buses can promise: axisctl budget of a file and of the daemon."""
import json
import pathlib
import re
import tempfile
import unittest

import canned
from support import AxisctlTest

SOURCE = pathlib.Path(__file__).parents[2]
DEMO = str(SOURCE / "config/examples/demo.yaml")
EXCEEDED = SOURCE / "tests/broken/budget.yaml"


class OfTheDaemon(AxisctlTest):
    def test_predicted_beside_seen(self):
        self.assertRegex(self.ok("budget"), r"(?s)^line-a\nMOVING +UTILISATION.*\nfeeder +alone .*\nline-b\n")
        self.server.answers |= {"GetBudget": canned.BUDGET, "ListGroups": canned.GROUPS}
        text = self.ok("budget")
        self.assertRegex(text, r"\n +0 +0\.25 +0\.50 +- +300\.0 ms +-\n")
        self.assertRegex(text, r"\nfeeder +alone +28\.0 ms +7\.0 ms +- \+ 150\.0 ms +10\.5 mm\n")
        self.assertRegex(text, r"\ntransfer +1 +28\.0 ms +-\n")
        self.assertIn("exceeded (stop_bound): too late; raise it\nnote: a note\n", text)
        self.assertEqual(self.json("budget")[0]["budgets"][0]["axes"][0]["observed"]["stop_frame"], "0.007s")


class OfAFile(AxisctlTest):
    def setUp(self):
        """No daemon needed."""
        self.server = type("Nobody", (), {"address": "unix:/nonexistent/s"})

    def test_each_bus(self):
        text = self.ok("budget", DEMO)
        self.assertRegex(text, r"(?s)^line-a\nMOVING +UTILISATION.*\nSTOPPED +LAST FRAME.*\nfeeder +all .*\nline-b\n.*\ncan0\n")
        self.assertEqual(len(re.findall(r"\nGROUP .*\ntransfer +1 +\d+\.\d ms +\d+\.\d ms\n", text)), 3)
        self.assertNotIn("note: all bounds presume", text)
        buses = self.json("budget", DEMO)[0]["budgets"]
        self.assertEqual([len(bus["stops"]) for bus in buses], [3, 2, 1])

    def test_the_demo_promises_what_a_machine_may_promise(self):
        seconds = lambda text: float(text.removesuffix("s"))
        for bus in self.json("budget", DEMO)[0]["budgets"]:
            self.assertEqual(bus["excess"], [], bus["bus"])
            for stop in bus["stops"]:
                self.assertLess(seconds(stop["last_frame"]), 0.12, bus["bus"])
                self.assertLess(seconds(stop["standstill"]), 1.2, bus["bus"])
            for row in bus["load"]:
                if row["moving"] > 0:
                    self.assertLess(seconds(row["refresh_moving"]), 1, bus["bus"])
                if "refresh_idle" in row:
                    self.assertLess(seconds(row["refresh_idle"]), 20, bus["bus"])

    def test_what_is_refused_has_figures_all_the_same(self):
        text, listed = self.run_axisctl("budget", str(EXCEEDED)), self.run_axisctl("--json", "budget", str(EXCEEDED))
        for refused in (text, listed):
            self.assertEqual((refused.returncode, len(refused.stderr.splitlines())), (2, 5), refused.stderr)
            self.assertRegex(refused.stderr, r"budget\.yaml:8:19: bus 'line-a': the last stop frame of all axes may take")
        self.assertRegex(text.stdout, r"(?s)^line-a\n.*\nfeeder +all +88\.0 ms.*\nexceeded \(stop_bound\): .*\nline-b\n"
                                      r".*\ncan0\n")
        self.assertEqual([len(bus["excess"]) for bus in json.loads(listed.stdout)["budgets"]], [3, 2, 2])

    def test_another_error_leaves_nothing_to_compute(self):
        with tempfile.TemporaryDirectory() as directory:
            broken = pathlib.Path(directory) / "bad.yaml"
            broken.write_text(EXCEEDED.read_text() + "nonsense: 1\n")
            refused = self.run_axisctl("budget", str(broken))
            self.assertEqual((refused.returncode, refused.stdout, len(refused.stderr.splitlines())), (2, "", 1))


if __name__ == "__main__":
    unittest.main()
