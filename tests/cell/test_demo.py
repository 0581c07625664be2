"""deploy/cell/demo.sh, as somebody runs it who wants to see a cell: it shows it, and leaves nothing behind."""
import os
import signal
import tempfile
import unittest

from harness import ROOT, Program, run, wait_for

DEMO = str(ROOT / "deploy" / "cell" / "demo.sh")


class Demo(unittest.TestCase):
    def setUp(self):
        if "AXISD_CELL_RIG" not in os.environ:
            self.fail("run this by tests/cell/run.sh: it makes networks")

    def nothing_is_left(self):
        self.assertEqual(run(["ip", "netns", "list"]).stdout, "")
        # All processes are this test's own, as it has process numbers of its own.
        names = run(["ps", "-e", "-o", "comm="]).stdout.split()
        self.assertEqual([name for name in names if name.startswith(("axisd", "etcd", "demo"))], [])

    def test_it_shows_a_cell_and_ends(self):
        for words in (["--machines", "3"], ["--machines", "2", "--members", "0"]):
            done = run([DEMO, "--once", *words], limit=300)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            self.assertIn("stopped and latched", done.stdout)
            self.nothing_is_left()

    def test_it_is_interrupted(self):
        with tempfile.TemporaryDirectory() as directory:
            demo = Program("demo", [DEMO, "--machines", "2", "--members", "0"], directory, {
                name: os.environ[name] for name in ("AXISD", "AXISD_CELL", "AXISCTL")})
            wait_for(lambda: "runs until Ctrl-C" in demo.output() or not demo.running(), "the cell runs", 300)
            self.assertTrue(demo.running(), demo.output() + demo.log())
            demo.process.send_signal(signal.SIGTERM)
            self.assertEqual(demo.wait(), 143, demo.log())
            self.nothing_is_left()


if __name__ == "__main__":
    unittest.main()
