"""The Python package as a user gets it: installed by pip without network, checked for types, its examples run against
the machine of config/examples/demo.yaml."""
import csv
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

from harness import LIMIT, ROOT, Demo, pb, wait_for

EXAMPLES = ROOT / "api" / "python" / "examples"


class PythonExamples(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.directory = pathlib.Path(tempfile.mkdtemp(prefix="axpython-"))
        cls.addClassCleanup(shutil.rmtree, cls.directory)
        # From a copy: pip builds beside the sources, and parallel tests share the tree.
        for name in ("api/python", "proto"):
            subprocess.run(["cp", "-r", "--parents", name, cls.directory], cwd=ROOT, check=True)
        subprocess.run([sys.executable, "-m", "venv", "--system-site-packages", cls.directory / "venv"], check=True)
        cls.python = str(cls.directory / "venv" / "bin" / "python")
        cls.check([cls.python, "-m", "pip", "install", "--no-index", "--no-build-isolation", "--no-deps", "--quiet",
                   cls.directory / "api" / "python"])
        cls.demo = Demo()
        cls.addClassCleanup(cls.demo.close)

    @staticmethod
    def check(words, **arguments):
        done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=3 * LIMIT, **arguments)
        if done.returncode != 0:
            raise AssertionError(f"{words}: {done.returncode}\n{done.stdout}{done.stderr}")
        return done.stdout

    def start(self, example, *words, **arguments):
        """An example as a process, from another directory than that of its sources."""
        environment = {key: value for key, value in os.environ.items() if not key.startswith(("AXISD_", "PYTHONPATH"))}
        process = subprocess.Popen([self.python, EXAMPLES / example, *map(str, words)], text=True, cwd=self.directory,
                                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                   env=environment | {"AXISD_SERVER": self.demo.server}, **arguments)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def finish(self, process, status=0):
        """Its output, once it has ended by itself with this status."""
        output, _ = process.communicate(timeout=3 * LIMIT)
        self.assertEqual(process.returncode, status, output)
        return output

    def test_the_package_and_the_examples_are_typed(self):
        site = self.check([self.python, "-c", "import axisd, os; print(os.path.dirname(axisd.__path__[0]))"]).strip()
        words = ["mypy", "--config-file", ROOT / "api/python/pyproject.toml", "--cache-dir", self.directory / "mypy"]
        environment = os.environ | {"MYPYPATH": site}
        self.check([*words, "-p", "axisd"], env=environment, cwd=self.directory)
        for example in EXAMPLES.glob("*.py"):
            self.check([*words, example], env=environment, cwd=self.directory)

    def test_the_same_program_on_each_model(self):
        axes = self.demo.models()
        self.assertEqual(sorted(axes), ["ess42-r", "ssd2608pr", "ykd2405pr", "yss-c"])
        running = {model: self.start("move_and_watch.py", axis, "--distance", 20) for model, axis in axes.items()}
        for model, process in running.items():
            output = self.finish(process)
            self.assertIn("DiscreteMotion", output)
            self.assertRegex(output, rf"{axes[model]} \({model}\) rests at [\d.]+ \w+, position Homed\n\Z")

    def test_a_deadman_button_needs_somebody_to_hold_it(self):
        process = self.start("deadman_jog.py", "turntable", stdin=subprocess.DEVNULL)
        self.assertIn("the button is a pipe or a terminal", self.finish(process, 2))

    def test_a_deadman_button(self):
        process = self.start("deadman_jog.py", "turntable", "--velocity", 30, stdin=subprocess.PIPE, bufsize=1)

        def press(until):
            deadline = time.monotonic() + LIMIT
            while not until():
                self.assertLess(time.monotonic(), deadline)
                process.stdin.write("\n")
                time.sleep(0.05)

        def moving():
            return self.demo.client.state("turntable").moving
        press(moving)
        wait_for(lambda: not moving(), "the button is released: it halts")
        press(moving)
        process.kill()
        wait_for(lambda: not moving(), "nobody holds the button any more: the daemon halts it")
        output = process.communicate(timeout=LIMIT)[0]
        self.assertRegex(output, r"\Ajogging at -?[\d.]+\nreleased: turntable halted at ")

    def test_events_to_csv_goes_on_where_it_was(self):
        file = self.directory / "events.csv"

        def rows():
            if not file.exists():
                return []
            with file.open(newline="") as lines:
                return list(csv.DictReader(lines))

        def collect(state):
            """Runs until the axis's change to this state is in the file."""
            process = self.start("events_to_csv.py", file, "--axis", "dial")
            self.demo.client.to_done({"Standstill": "Enable", "Disabled": "Disable"}[state], "dial")
            wait_for(lambda: any(f"to_state={state} " in row["content"] for row in rows()[before:]), f"{state} in the file")
            process.send_signal(signal.SIGINT)
            self.finish(process)
        before = 0
        self.demo.client.to_done("Disable", "dial")
        collect("Standstill")
        before = len(rows())
        collect("Disabled")
        sequences = [int(row["sequence"]) for row in rows()]
        self.assertEqual(sequences, sorted(set(sequences)), "in order, and nothing twice")
        self.assertEqual({row["axis"] for row in rows()}, {"dial"})

    def test_parameters_are_saved_and_restored(self):
        file = self.directory / "lifter.json"
        self.assertRegex(self.finish(self.start("parameter_backup.py", "save", "lifter", file)), r"\d+ parameters saved")
        backup = json.loads(file.read_text())
        present = backup["values"]["lock_current"]
        backup["values"]["lock_current"] = present + 1
        file.write_text(json.dumps(backup))
        output = self.finish(self.start("parameter_backup.py", "restore", "lifter", file))
        self.assertIn(f"lock_current {present} -> {present + 1}\nlifter: 1 of ", output)
        output = self.finish(self.start("parameter_backup.py", "restore", "dial", file), status=1)
        self.assertIn("is of a ykd2405pr, and dial is a ess42-r", output)

    def test_a_sequence_and_what_may_go_wrong(self):
        output = self.finish(self.start("sequence.py", "lifter=40", "feeder=30"))
        self.assertRegex(output, r"\Alifter: move_relative Done at 35.000 mm\nfeeder: move_relative Done at 30.000 mm\n\Z")
        output = self.finish(self.start("sequence.py", "lifter=40", "feeder=9000"), status=1)
        self.assertRegex(output, r"(?s)\Alifter: move_relative Done.*\nfeeder: .*permitted")
        for axis in ("lifter", "feeder"):
            self.assertEqual(self.demo.client.state(axis).state, pb.STATE_STANDSTILL)


if __name__ == "__main__":
    unittest.main()
