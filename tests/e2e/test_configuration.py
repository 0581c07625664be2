"""What the daemon serves, and what it says of other files."""
import json
import pathlib
import unittest

from harness import AXISCTL, Scenario, feeder, run


class Configuration(Scenario):
    def axisctl(self, machine, *words):
        return run([AXISCTL, "--server", f"unix:{machine.socket}", *words], limit=60)

    def test_shows_what_was_read_at_the_start(self):
        machine = self.machine({"feeder": feeder()}).start()
        text = pathlib.Path(machine.config).read_text()
        pathlib.Path(machine.config).write_text("machine: somebody-else\n")
        shown = self.axisctl(machine, "config", "show")
        self.assertEqual((shown.returncode, shown.stdout), (0, text))
        served = json.loads(self.axisctl(machine, "--json", "config", "show").stdout)
        self.assertEqual((served["path"], served["yaml"]), (machine.config, text))

    def test_judges_other_files_as_a_start_would(self):
        machine = self.machine({"feeder": feeder()}).start()
        text = pathlib.Path(machine.config).read_text()
        other = pathlib.Path(machine.directory) / "other.yaml"
        other.write_text(text)
        same = self.axisctl(machine, "config", "check", str(other))
        self.assertEqual((same.returncode, same.stdout), (0, f"{other}: ok, and it is what is served\n"), same.stderr)
        other.write_text(text + "# changed\n")
        changed = self.axisctl(machine, "config", "check", str(other))
        self.assertEqual((changed.returncode, changed.stdout), (0, f"{other}: ok, not served yet\n"), changed.stderr)
        other.write_text(text.replace("model: ykd2405pr", "model: ykd2405"))
        broken = self.axisctl(machine, "config", "check", str(other))
        self.assertEqual((broken.returncode, broken.stdout), (2, ""))
        offline = run([AXISCTL, "check", str(other)], limit=60)
        self.assertEqual(broken.stderr.splitlines(), offline.stderr.splitlines()[:-1])
        self.assertRegex(broken.stderr, rf"^{other}:\d+:\d+: .*ykd2405.*ykd2405pr")
        missing = self.axisctl(machine, "config", "check", "/nonexistent.yaml")
        self.assertEqual(missing.returncode, 2)
        self.assertIn("/nonexistent.yaml", missing.stderr)


if __name__ == "__main__":
    unittest.main()
