"""Each alarm in mid-move, and how each is left (manual chapter 8)."""
import time
import unittest

from harness import DONE, START, STOP, CallFailed, Scenario, error_pb, pb, wait_for


class Alarms(Scenario):
    def raised(self, code):
        """A machine whose drive has raised the alarm in mid-move."""
        machine = self.ready_feeder()
        move = self.move_under_way(machine)
        at = time.monotonic_ns()
        machine.sim.control(f"alarm 1 {code}")
        state = machine.client.wait_state("feeder", lambda s: s.state == pb.STATE_ERROR_STOP, f"alarm {code}")
        self.assertEqual((state.fault.native_code, state.fault.reason),
                         (code, error_pb.REASON_ALARM), state)
        self.assertTrue(state.fault.remedy, state)
        ended = self.assert_command(machine.client.wait_ended(move), "ERROR")
        self.assertEqual(ended.cause.native_code, code)
        machine.sim.wait_rest()
        machine.client.wait_state("feeder", lambda s: not s.moving, "standstill is reported")
        wait_for(lambda: machine.wire.writes(STOP, 0, since=at), "a stop on the wire")
        self.assertEqual(machine.wire.writes(START, since=at), [])
        wait_for(lambda: self.why_refused(machine) != "REASON_STOPPING", "the stop is confirmed")
        self.assertEqual(self.why_refused(machine), "REASON_ALARM")
        return machine

    def why_refused(self, machine):
        with self.assertRaises(CallFailed) as caught:
            machine.client.motion("MoveRelative", "feeder", distance=1.0)
        return caught.exception.reason

    def resets(self, machine):
        """Reset works; then the axis can be used again."""
        machine.client.to_done("Reset", "feeder")
        state = machine.client.state("feeder")
        self.assertIn(state.state, (pb.STATE_STANDSTILL, pb.STATE_DISABLED), state)
        self.assertEqual((state.alarm_code, state.trust), (0, pb.POSITION_TRUST_UNKNOWN))
        starts = machine.sim.shaft().starts
        machine.client.to_done("Enable", "feeder")
        self.assertEqual(machine.sim.shaft().starts, starts)
        machine.client.to_done("MoveRelative", "feeder", distance=1.0)

    def refuses_reset(self, machine):
        detail = self.refused("FAILED_PRECONDITION", "ALARM", machine.client.motion, "Reset", "feeder")
        self.assertTrue(detail.remedy, detail)
        self.assert_state(machine.client.state("feeder"), "ERROR_STOP")

    def resets_in_vain(self, machine, code):
        command = self.assert_command(machine.client.motion("Reset", "feeder", wait=DONE), "ERROR")
        self.assertEqual((command.cause.reason, command.cause.native_code), (error_pb.REASON_ALARM, code), command)
        self.assertTrue(command.cause.remedy, command)
        self.assert_state(machine.client.state("feeder"), "ERROR_STOP")

    def needs_power_cycle(self, code):
        machine = self.raised(code)
        self.refuses_reset(machine)
        machine.sim.control("alarm 1 0")
        self.refuses_reset(machine)
        machine.sim.control("power 1 off")
        machine.client.wait_state("feeder", lambda s: s.link == pb.LINK_STATE_OFFLINE, "offline")
        machine.sim.control("power 1 on")
        state = machine.client.wait_online("feeder")
        self.assert_state(state, "ERROR_STOP")
        self.resets(machine)

    def clears_itself(self, code):
        machine = self.raised(code)
        self.resets_in_vain(machine, code)
        machine.sim.control("alarm 1 0")
        state = machine.client.wait_state("feeder", lambda s: s.alarm_code == 0, "the alarm clears itself")
        self.assert_state(state, "ERROR_STOP")
        self.refused("FAILED_PRECONDITION", "ALARM", machine.client.motion, "MoveRelative", "feeder", distance=1.0)
        self.resets(machine)

    def test_1_overcurrent(self):
        self.needs_power_cycle(1)

    def test_2_overvoltage(self):
        self.clears_itself(2)

    def test_3_undervoltage(self):
        self.clears_itself(3)

    def test_4_eeprom(self):
        self.resets(self.raised(4))

    def test_5_position_error(self):
        self.needs_power_cycle(5)


if __name__ == "__main__":
    unittest.main()
