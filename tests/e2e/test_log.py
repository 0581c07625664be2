"""The daemon's log: its level while it runs, and what clients can make of it."""
import unittest

from harness import Scenario, wait_for


class Level(Scenario):
    def test_is_changed_while_axes_move(self):
        machine = self.ready_feeder()
        self.move_under_way(machine, beyond=2.0, velocity=20.0)
        self.assertEqual(machine.axisctl("log-level").stdout, "info\n")
        self.assertEqual(machine.axisctl("log-level", "debug").returncode, 0)
        wait_for(lambda: "the log has level debug now, and had info\n" in machine.daemon.log(), "the change is told")
        machine.axisctl("watch", "feeder", "--count", "1")
        wait_for(lambda: " debug " in machine.daemon.log(), "it says more")
        self.assertEqual(machine.axisctl("log-level", "error").returncode, 0)
        wait_for(lambda: "the log has level error now, and had debug\n" in machine.daemon.log(), "the change is told")
        machine.client.to_done("Stop", "feeder")
        self.assertEqual(machine.axisctl("log-level", "info").returncode, 0)
        wait_for(lambda: all(f"the log has level {level} now" in machine.axisctl("audit", "--kind", "call").stdout
                             for level in ("debug", "error", "info")), "each change has a record")
        # Of what happened meanwhile there is nothing.
        between = machine.daemon.log().split("the log has level error now")[1].split("the log has level info now")[0]
        self.assertNotIn(" info ", between.split("\n", 1)[1].rsplit("\n", 1)[0])


if __name__ == "__main__":
    unittest.main()
