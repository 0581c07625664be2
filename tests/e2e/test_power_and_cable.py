"""The drive is switched off, restarted unnoticed, or its cable is cut, while it moves."""
import time
import unittest

from harness import ENABLE, HOMING, START, STOP, CallFailed, DONE, Scenario, error_pb, feeder, pb, wait_for


class SwitchedOff(Scenario):
    def test_in_mid_move(self):
        machine = self.ready_feeder()
        move = self.move_under_way(machine)
        off = time.monotonic_ns()
        machine.sim.control("power 1 off")
        state = machine.client.wait_state("feeder", lambda s: s.link == pb.LINK_STATE_OFFLINE, "offline")
        self.assertTrue(state.link_error.message and state.link_error.remedy, state)
        ended = self.assert_command(machine.client.wait_ended(move), "UNKNOWN")
        self.assertEqual(ended.cause.outcome, error_pb.OUTCOME_UNKNOWN, ended)
        self.refused("FAILED_PRECONDITION", "FAULT", machine.client.motion, "MoveAbsolute", "feeder", position=1.0)

        starts = machine.sim.shaft().starts
        machine.sim.control("power 1 on")
        state = machine.client.wait_online("feeder")
        self.assert_state(state, "ERROR_STOP")
        self.assertEqual((state.enabled, state.trust, state.drive_reboots), (False, pb.POSITION_TRUST_UNKNOWN, 1), state)
        # Nothing was started or switched on by the daemon, then or since.
        machine.client.to_done("Reset", "feeder")
        for register in (START, HOMING, ENABLE):
            self.assertEqual(machine.wire.writes(register, since=off), [])
        self.assertEqual(machine.sim.shaft()[1:], (False, starts))
        self.assert_state(machine.client.state("feeder"), "DISABLED")
        self.assert_command(machine.client.get_command(move), "UNKNOWN")


class RestartedUnnoticed(Scenario):
    def rebooted(self, machine, since):
        state = machine.client.wait_state("feeder", lambda s: s.drive_reboots == 1 and s.link == pb.LINK_STATE_ONLINE,
                                          "the restart is reported")
        self.assertEqual((state.trust, state.enabled), (pb.POSITION_TRUST_UNKNOWN, False), state)
        self.assertEqual(machine.wire.writes(START, since=since), [])
        self.assertFalse(machine.sim.shaft().moving)
        self.refused("FAILED_PRECONDITION", "DISABLED", machine.client.motion, "MoveRelative", "feeder", distance=10.0)

    def test_between_two_polls(self):
        # It boots in just more than reboot_guard, as every drive has to: one that is back sooner may be started on what
        # was read before. Nothing is read meanwhile.
        machine = self.ready_feeder(simulated="boot_ms=320", reboot_guard="300 ms", poll="{ idle: 700 ms }")
        machine.client.to_done("MoveRelative", "feeder", distance=10.0)
        since = time.monotonic_ns()
        machine.sim.control("power 1 off")
        machine.sim.control("power 1 on")
        time.sleep(0.35)
        try:  # identical to the first: the block that it needs once stood in the drive
            move = machine.client.motion("MoveRelative", "feeder", distance=10.0, wait=DONE)
            self.assert_command(move, "ABORTED")
            # A poll may see the released power stage before the canary tells why.
            self.assertIn(move.cause.reason, (error_pb.REASON_REBOOTED, error_pb.REASON_TERMINAL), move)
        except CallFailed as refused:  # a poll was quicker than the call
            self.assertIn(refused.reason, ("REASON_REBOOTED", "REASON_CONFIGURING", "REASON_DISABLED"), refused)
        self.rebooted(machine, since)

    def test_within_the_start(self):
        machine = self.ready_feeder()
        machine.client.to_done("MoveRelative", "feeder", distance=10.0)
        since = time.monotonic_ns()
        machine.sim.control("fault reboot_before node=1 function=16 register=0x0020")
        move = machine.client.motion("MoveRelative", "feeder", distance=10.0, wait=DONE)
        self.assertIn(move.state, (pb.COMMAND_STATE_ABORTED, pb.COMMAND_STATE_ERROR, pb.COMMAND_STATE_UNKNOWN), move)
        state = machine.client.wait_state("feeder", lambda s: s.drive_reboots == 1 and s.link == pb.LINK_STATE_ONLINE,
                                          "the restart is reported")
        self.assertEqual((state.trust, state.enabled), (pb.POSITION_TRUST_UNKNOWN, False), state)
        self.assertEqual(machine.wire.writes(START, since=since), [])


class CableCut(Scenario):
    """The drive has no watchdog of its own: it goes on until the cable is back."""

    def cut_and_join(self, machine, axis, command):
        machine.sim.wait_moving()
        cut = time.monotonic()
        machine.sim.control("cut")
        machine.client.wait_state(axis, lambda s: s.link == pb.LINK_STATE_OFFLINE, f"{axis} offline")
        self.assert_command(machine.client.wait_ended(command), "UNKNOWN")
        wait_for(lambda: time.monotonic() > cut + 5, "5 s without the cable")
        self.assertTrue(machine.sim.shaft().moving, "the scenario is void: the drive stands before the cable is back")
        joined = time.monotonic_ns()
        machine.sim.control("join")
        state = machine.client.wait_online(axis)
        self.assert_state(state, "ERROR_STOP")
        self.assertFalse(machine.sim.shaft().moving)
        self.assertFalse(state.moving)
        frames = machine.wire.requests(node=1, since=joined)
        self.assertTrue(frames[0].writes(STOP, 0), [str(frame) for frame in frames[:5]])
        for register in (START, HOMING, ENABLE):
            self.assertEqual(machine.wire.writes(register, since=joined), [])
        self.assertEqual(state.drive_reboots, 0)
        machine.client.to_done("Reset", axis)
        self.assert_state(machine.client.state(axis), "STANDSTILL")

    def test_velocity(self):
        machine = self.ready_spinner()
        command = machine.client.motion("MoveVelocity", "spinner", velocity=5.0)
        self.cut_and_join(machine, "spinner", command)

    def test_homing(self):
        machine = self.machine({"feeder": feeder(simulated="home=-2000000:-1900000")}).start()
        machine.client.to_done("Enable", "feeder")
        command = machine.client.motion("Home", "feeder")
        self.cut_and_join(machine, "feeder", command)
        self.assertEqual(machine.client.state("feeder").trust, pb.POSITION_TRUST_UNKNOWN)

    def test_position(self):
        machine = self.ready_feeder()
        command = machine.client.motion("MoveAbsolute", "feeder", position=390.0, velocity=20.0)
        self.cut_and_join(machine, "feeder", command)
        # The counter ran on in the drive: it is where the load is.
        self.assertAlmostEqual(machine.client.state("feeder").position, machine.sim.shaft().position / 2000, places=3)


if __name__ == "__main__":
    unittest.main()
