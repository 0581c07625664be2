"""The binaries' behaviour towards configurations: what they print, where, and how they end."""
import json
import pathlib
import shutil
import unittest

from certificates import Certificates
from harness import AXISCTL, AXISD, ROOT, Scenario, feeder, run

BROKEN = sorted((ROOT / "tests" / "broken").glob("*.yaml"))
EXAMPLES = [*sorted((ROOT / "config" / "examples").glob("*.yaml")), ROOT / "deploy" / "axisd.yaml"]


class Check(Scenario):
    def test_broken_files(self):
        self.assertGreater(len(BROKEN), 40)
        for path in BROKEN:
            with self.subTest(path=path.name):
                done = run([AXISD, "--check", "--config", str(path)])
                self.assertEqual((done.returncode, done.stdout), (2, ""), done)
                expected = path.with_suffix(".expected").read_text().splitlines()
                # The file's name is printed as it was given.
                self.assertEqual([line.replace(f"{path.parent}/", "") for line in done.stderr.splitlines()], expected)

    def test_a_broken_file_is_not_served(self):
        done = run([AXISD, "--config", str(BROKEN[0])])
        self.assertEqual((done.returncode, done.stdout), (2, ""))
        self.assertIn(str(BROKEN[0]), done.stderr)

    def test_examples(self):
        self.assertTrue(EXAMPLES)
        folder = pathlib.Path(self.machine({}).path("examples"))
        shutil.copytree(EXAMPLES[0].parent, folder)  # they name files beside them
        ours = Certificates(folder, "clients")
        ours.issue("server")
        ours.revoke_nothing()
        for example in EXAMPLES:
            with self.subTest(path=example.name):
                path = folder / example.name
                path.write_text(example.read_text().replace("/etc/axisd/tls/", f"{folder}/"))
                done = run([AXISD, "--check", "--config", str(path)])
                self.assertEqual((done.returncode, done.stderr), (0, ""))
                self.assertRegex(done.stdout, r"\A" + str(path) + r": ok \(\d+ axes on \d+ buses\)\n\Z")

    def test_a_budget_that_is_only_warned_of(self):
        path = pathlib.Path(self.machine({}).path("warned.yaml"))
        path.write_text((ROOT / "tests" / "broken" / "budget.yaml").read_text().replace("budget: refuse", "budget: warn"))
        done, ctl = run([AXISD, "--check", "--config", str(path)]), run([AXISCTL, "check", str(path)])
        for checked in (done, ctl):
            self.assertEqual(checked.returncode, 0, checked)
            self.assertRegex(checked.stdout, r"\A" + str(path) + r": ok[^\n]*\n\Z")
            self.assertEqual(len(checked.stderr.splitlines()), 7, checked)
            self.assertIn(f"{path}: warning: line-b: the last stop frame of all axes may take 88.0 ms, longer than 1 ms; "
                          "lower turnaround_max, put axes on another bus, or raise stop_bound\n", checked.stderr)
        self.assertEqual(done.stderr, ctl.stderr)
        listed = json.loads(run([AXISCTL, "--json", "check", str(path)]).stdout)
        self.assertEqual((listed["valid"], listed["diagnostics"], len(listed["warnings"])), (True, [], 7))

    def test_axisctl_agrees(self):
        for path in (BROKEN[0], BROKEN[-1], EXAMPLES[0]):
            daemon = run([AXISD, "--check", "--config", str(path)])
            done = run([AXISCTL, "check", str(path)])
            self.assertEqual(done.returncode, daemon.returncode, done)
            for line in daemon.stderr.splitlines():
                self.assertIn(line, done.stderr + done.stdout)

    def test_no_such_file(self):
        done = run([AXISD, "--check", "--config", "/nonexistent/axisd.yaml"])
        self.assertEqual((done.returncode, done.stdout), (2, ""))
        self.assertRegex(done.stderr, r"\A/nonexistent/axisd.yaml[^\n]*\n\Z")

    def test_command_line(self):
        wrong = run([AXISD, "--nonsense"])
        self.assertEqual((wrong.returncode, wrong.stdout), (2, ""))
        self.assertRegex(wrong.stderr, r"\Aaxisd: .*--nonsense[^\n]*\n\Z")
        self.assertEqual(run([AXISD, "--help"]).returncode, 0)
        version = run([AXISD, "--version"])
        self.assertEqual((version.returncode, version.stderr), (0, ""))
        self.assertRegex(version.stdout, r"\Aaxisd \d+\.\d+\.\d+\n\Z")
        json.loads(run([AXISD, "--schema"]).stdout)

    def test_state_directory_that_cannot_be_written(self):
        machine = self.machine({"feeder": feeder()})
        blocker = pathlib.Path(machine.path("file"))
        blocker.write_text("")
        done = run([AXISD, "--config", machine.config, "--state-directory", str(blocker / "state")])
        self.assertEqual(done.returncode, 1, done)
        self.assertIn(str(blocker), done.stderr)


if __name__ == "__main__":
    unittest.main()
