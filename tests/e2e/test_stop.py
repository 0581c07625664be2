"""A stop in mid-move."""
import time
import unittest

from harness import DONE, START, STOP, Scenario, axis_pb, error_pb, feeder, pb


def monotonic(timestamp):
    """A wall-clock time stamp of the daemon on the clock of the wire logs, ns."""
    return timestamp.ToNanoseconds() - time.time_ns() + time.monotonic_ns()


class Stop(Scenario):
    def stopped(self, machine, kind, value):
        move = self.move_under_way(machine)
        called = time.monotonic_ns()
        stop = machine.client.motion(kind, "feeder", wait=DONE)
        self.assert_command(stop, "DONE")
        self.assertFalse(machine.sim.shaft().moving)
        aborted = self.assert_command(machine.client.get_command(move), "ABORTED")
        self.assertEqual(aborted.cause.reason, error_pb.REASON_SUPERSEDED, aborted)
        self.assertIn(stop.id, aborted.cause.message)
        state = machine.client.state("feeder")
        self.assert_state(state, "STANDSTILL")
        self.assertTrue(20 < state.position < 290, state)

        # Not more than the transaction that was in flight went out between the request's arrival and its frame.
        frame = machine.wire.writes(STOP, node=1, since=called)[0]
        self.assertEqual(frame.values, [value])
        between = machine.wire.requests(since=monotonic(stop.accepted_at), until=frame.time)
        self.assertLessEqual(len(between), 1, [str(f) for f in between])
        self.assertEqual([f for f in between if f.is_write], [])
        # And after it nothing starts by itself.
        self.assertEqual(machine.wire.writes(START, since=called), [])
        return state

    def test_stop(self):
        machine = self.ready_feeder()
        state = self.stopped(machine, "Stop", 0)
        self.assertEqual(state.trust, pb.POSITION_TRUST_SET)
        # The position was kept: the next move arrives, in both pictures.
        machine.client.to_done("MoveAbsolute", "feeder", position=5.0)
        self.assertEqual(machine.sim.shaft().position, 10000)

    def test_quick_stop_costs_the_trust(self):
        machine = self.ready_feeder()
        state = self.stopped(machine, "QuickStop", 1)
        self.assertEqual(state.trust, pb.POSITION_TRUST_UNKNOWN)
        self.refused("FAILED_PRECONDITION", "NOT_TRUSTED", machine.client.motion, "MoveAbsolute", "feeder", position=5.0)

    def test_halt_gives_way_to_a_move(self):
        machine = self.ready_feeder()
        move = self.move_under_way(machine)
        halt = machine.client.motion("Halt", "feeder")
        machine.client.to_done("MoveAbsolute", "feeder", position=1.0)
        self.assert_command(machine.client.get_command(move), "ABORTED")
        self.assertIn(machine.client.get_command(halt).state, (pb.COMMAND_STATE_DONE, pb.COMMAND_STATE_ABORTED))
        self.assertEqual(machine.sim.shaft().position, 2000)

    def stop_in_homing(self, switch):
        machine = self.machine({"feeder": feeder(simulated=f"home=-2000000:-1900000,{switch}")}).start()
        machine.client.to_done("Enable", "feeder")
        home = machine.client.motion("Home", "feeder")
        machine.client.wait_state("feeder", lambda s: s.moving and s.state == pb.STATE_HOMING, "homing")
        stop = machine.client.motion("Stop", "feeder", wait=DONE)
        self.assert_command(machine.client.get_command(home), "ABORTED")
        self.assertEqual(machine.client.state("feeder").trust, pb.POSITION_TRUST_UNKNOWN)
        return machine, stop

    def test_in_homing(self):
        machine, stop = self.stop_in_homing("switch.stop_ignored_in_homing=off")
        self.assert_command(stop, "DONE")
        self.assertFalse(machine.sim.shaft().moving)

    def test_in_homing_of_a_drive_that_does_not_listen(self):
        """The manual defines 0x0028 for position and speed mode only: then it is escalated, and said."""
        machine, stop = self.stop_in_homing("switch.stop_ignored_in_homing=on")
        self.assert_command(stop, "ERROR")
        self.assertEqual(stop.cause.reason, error_pb.REASON_NOT_CONFIRMED, stop)
        self.assert_state(machine.client.state("feeder"), "ERROR_STOP")
        self.assertEqual([frame.values for frame in machine.wire.writes(STOP)][:2], [[0], [1]])

    def test_held_stop(self):
        machine = self.ready_feeder()
        self.move_under_way(machine)
        self.assert_command(machine.client.motion("Stop", "feeder", wait=DONE, hold=True, request_id="door"), "DONE")
        state = machine.client.state("feeder")
        self.assert_state(state, "STOPPING")
        self.assertTrue(state.stop_held)
        self.refused("FAILED_PRECONDITION", "STOPPING", machine.client.motion, "MoveAbsolute", "feeder", position=1.0)
        machine.client.call(machine.client.axis.ReleaseStop, axis_pb.ReleaseStopRequest(axis="feeder", request_id="door"))
        self.assert_state(machine.client.state("feeder"), "STANDSTILL")
        machine.client.to_done("MoveAbsolute", "feeder", position=1.0)

    def test_a_new_move_replaces_the_one_in_progress(self):
        machine = self.ready_feeder()
        first = self.move_under_way(machine)
        machine.client.to_done("MoveAbsolute", "feeder", position=10.0)
        self.assert_command(machine.client.get_command(first), "ABORTED")
        # M9: stopped and confirmed before it was started anew.
        starts = machine.wire.writes(START)
        stops = machine.wire.writes(STOP, since=starts[0].time, until=starts[-1].time)
        self.assertEqual((len(starts), len(stops)), (2, 1))
        self.assertEqual(machine.sim.shaft().position, 20000)


if __name__ == "__main__":
    unittest.main()
