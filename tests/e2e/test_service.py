"""axisd under a supervisor that does what systemd does with deploy/axisd.service. How long each step takes on a computer with
nothing else to do is measured by tests/bench/hang_bench.py."""
import os
import pathlib
import signal
import time
import unittest

from harness import START, STOP, Scenario, Supervisor, Unit, feeder, pb

#: The unit's second is for a machine's computer, not for one that runs many tests at once.
PATIENCE = 5


class Service(Scenario):
    def supervised(self, machine):
        machine.start_lines()
        supervisor = Supervisor(machine, patience=PATIENCE)
        self.addCleanup(supervisor.close)
        return supervisor

    def moving_feeder(self):
        """A machine whose axis is in a move that takes longer than all of this, and its supervisor."""
        machine = self.machine({"feeder": feeder()})
        supervisor = self.supervised(machine)
        supervisor.wait_for("READY=1")
        machine.client.wait_online("feeder")
        machine.client.to_done("Enable", "feeder")
        machine.client.to_done("SetPosition", "feeder", position=0.0)
        self.move_under_way(machine, position=390.0, beyond=2.0, velocity=5.0)
        return machine, supervisor

    def assert_told_to_stop_and_nothing_else(self, machine, since):
        """The first that the drive was told by what came after the daemon, and that nothing was started again."""
        writes = machine.sim.wire.writes(node=1, since=since)
        self.assertTrue(writes and writes[0].writes(STOP, 0), [str(frame) for frame in writes[:5]])
        self.assertEqual(machine.sim.wire.writes(START, since=since), [])

    def assert_known_or_not_trusted(self, machine):
        machine.client.wait_online("feeder")
        state = machine.client.wait_state("feeder", lambda s: s.state in (pb.STATE_STANDSTILL, pb.STATE_ERROR_STOP),
                                          "the feeder rests")
        if state.trust == pb.POSITION_TRUST_UNKNOWN:
            return
        self.assertEqual(state.trust, pb.POSITION_TRUST_RESTORED)
        self.assertAlmostEqual(state.position, machine.sim.shaft().position / 2000)

    def test_a_hang_in_mid_move_is_killed_quiesced_and_restarted(self):
        machine, supervisor = self.moving_feeder()
        hung = machine.daemon
        self.assertTrue(machine.sim.shaft().moving)
        os.kill(hung.process.pid, signal.SIGSTOP)
        at = time.monotonic_ns()
        killed = supervisor.wait_for("SIGKILL", since=at)
        ready = supervisor.wait_for("READY=1", since=at)
        self.assertEqual(supervisor.events(since=killed)[:5], ["SIGKILL", "ended -9", "quiesced 0", "started", "READY=1"])
        last_word = supervisor.last_word_before(killed)
        self.assertGreaterEqual(killed - last_word, supervisor.interval * 1e9, "not before its time")
        self.assertEqual(supervisor.events(since=max(at, last_word) + 1, without=())[0], "SIGKILL", "it said nothing more")
        shaft = machine.sim.shaft()
        self.assertFalse(shaft.moving)
        self.assertLess(shaft.position, 390 * 2000, "in mid-move")
        self.assert_told_to_stop_and_nothing_else(machine, since=killed)
        self.assertLess(machine.sim.wire.writes(STOP, since=killed)[0].time, ready, "before the daemon was back")
        self.assert_known_or_not_trusted(machine)
        self.assertEqual(machine.sim.shaft().position, shaft.position, "the restart moves nothing")
        self.assertNotIn("left", supervisor.events())

    def test_a_crash_is_quiesced_and_restarted(self):
        machine, supervisor = self.moving_feeder()
        at = time.monotonic_ns()
        machine.daemon.process.kill()
        killed = time.monotonic_ns()
        supervisor.wait_for("READY=1", since=at)
        self.assertEqual(supervisor.events(since=at)[:4], ["ended -9", "quiesced 0", "started", "READY=1"])
        self.assertFalse(machine.sim.shaft().moving)
        self.assert_told_to_stop_and_nothing_else(machine, since=killed)
        self.assert_known_or_not_trusted(machine)

    def test_a_stop_is_waited_for_and_final(self):
        machine, supervisor = self.moving_feeder()
        supervisor.close()
        self.assertEqual(supervisor.events()[-4:], ["STOPPING=1", "ended 0", "quiesced 0", "left"])
        self.assertFalse(machine.sim.shaft().moving)

    def test_errors_of_the_configuration_are_not_tried_again(self):
        machine = self.machine({"feeder": feeder()})
        config = pathlib.Path(machine.config)
        config.write_text(config.read_text() + "nonsense: 1\n")
        supervisor = self.supervised(machine)
        supervisor.wait_for("left")
        self.assertEqual([what for what in supervisor.events() if not what.startswith("quiesced")],
                         ["started", "ended 2", "left"])

    def test_the_unit_is_as_the_manual_says(self):
        unit = Unit()
        self.assertLessEqual(unit.watchdog, 1)
        self.assertEqual(unit.watchdog_signal, signal.SIGKILL)
        self.assertFalse(unit.restarts(2))
        self.assertTrue(all(unit.restarts(status) for status in (1, -signal.SIGKILL, -signal.SIGSEGV)))


if __name__ == "__main__":
    unittest.main()
