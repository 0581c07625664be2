"""Adapters that are pulled out, come late, or belong to somebody else; line settings."""
import os
import time
import unittest

from harness import STOP, Scenario, error_pb, feeder, pb, spinner, wait_for


class Adapter(Scenario):
    def bus(self, machine):
        (bus,) = machine.client.buses()
        return bus

    def test_pulled_out_at_rest(self):
        machine = self.ready_feeder()
        self.assertTrue(self.bus(machine).open)
        machine.sim.control("hangup")
        state = machine.client.wait_state("feeder", lambda s: s.link == pb.LINK_STATE_OFFLINE, "offline")
        self.assertEqual(state.link_error.reason, error_pb.REASON_BUS_DOWN, state)
        bus = self.bus(machine)
        self.assertFalse(bus.open)
        self.assertIn(machine.path("line"), bus.error.message)
        self.refused("UNAVAILABLE", "OFFLINE", machine.client.motion, "MoveAbsolute", "feeder", position=1.0)
        machine.sim.control("replug")
        state = machine.client.wait_online("feeder")
        # The drive was powered all the time and the daemon can prove it.
        self.assert_state(state, "STANDSTILL")
        self.assertEqual((state.drive_reboots, state.trust), (0, pb.POSITION_TRUST_SET), state)
        self.assertTrue(self.bus(machine).open)
        machine.client.to_done("MoveAbsolute", "feeder", position=5.0)

    def test_pulled_out_in_mid_move(self):
        machine = self.ready_spinner()
        command = machine.client.motion("MoveVelocity", "spinner", velocity=5.0)
        machine.sim.wait_moving()
        machine.client.wait_state("spinner", lambda s: s.moving, "motion is seen")
        machine.sim.control("hangup")
        self.assert_command(machine.client.wait_ended(command), "UNKNOWN")
        self.assertTrue(machine.sim.shaft().moving)
        back = time.monotonic_ns()
        machine.sim.control("replug")
        state = machine.client.wait_online("spinner")
        self.assert_state(state, "ERROR_STOP")
        self.assertFalse(machine.sim.shaft().moving)
        (first, *_) = [f for f in machine.wire.requests(since=back) if f.node != 248]  # 248: the echo probe
        self.assertTrue(first.writes(STOP, 0), str(first))

    def test_missing_at_start(self):
        machine = self.machine({"late": feeder(1), "there": spinner(2, bus="second")})
        machine.start_line("second")
        machine.start_daemon()
        machine.client.wait_online("there")
        state = machine.client.state("late")
        self.assertEqual(state.link, pb.LINK_STATE_OFFLINE)
        self.assertIn(machine.path("line"), state.link_error.message)
        self.assertTrue(state.link_error.remedy)
        self.refused("UNAVAILABLE", "OFFLINE", machine.client.motion, "Enable", "late")
        machine.client.to_done("Enable", "there")
        machine.client.to_done("MoveRelative", "there", distance=1.0)
        machine.start_line("line")
        machine.client.wait_online("late")
        machine.client.to_done("Enable", "late")

    def test_in_use_by_another_axisd(self):
        first = self.machine({"feeder": feeder()}).start()
        second = self.machine({"feeder": feeder()})
        os.symlink(first.path("line"), second.path("line"))
        second.start_daemon()
        wait_for(lambda: self.bus(second).error.message, "the second one says why its bus is not open")
        bus = self.bus(second)
        self.assertFalse(bus.open)
        holder = f"axisd (pid {first.daemon.process.pid})"
        self.assertIn(holder, bus.error.message)
        self.assertIn(second.path("line"), bus.error.message)
        wait_for(lambda: holder in second.daemon.log(), "the log names the holder", limit=10)
        self.assertEqual(second.client.state("feeder").link, pb.LINK_STATE_OFFLINE)
        # The first one is not disturbed.
        first.client.to_done("Enable", "feeder")
        # And the second one takes over by itself when the first has gone.
        self.assertEqual(first.daemon.terminate(), 0)
        second.client.wait_online("feeder")


class LineSettings(Scenario):
    """Every setting of the manual (DIP switches, 0x0014, 0x0015), as far as a pty can show them: it has no parity."""

    def works(self, baud, serial_format):
        machine = self.machine({"spinner": spinner()}, baud=baud, serial_format=serial_format).start()
        machine.client.to_done("Enable", "spinner")
        machine.client.to_done("MoveRelative", "spinner", distance=1.0)
        self.assertEqual(machine.sim.shaft().position, 1000)
        (bus,) = machine.client.buses()
        self.assertEqual((bus.baud, bus.open, bus.exceptions), (baud, True, 0), bus)

    def test_baud_rates(self):
        for baud in (9600, 14400, 19200, 38400, 115200, 128000, 256000):
            with self.subTest(baud=baud):
                self.works(baud, "8N1")

    def test_formats(self):
        for serial_format in ("8N1", "8N2", "8E1", "8O1"):
            with self.subTest(format=serial_format):
                self.works(115200, serial_format)


if __name__ == "__main__":
    unittest.main()
