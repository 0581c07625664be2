"""Somebody sets the computer's clock, by a day forth and by two back, while axes move and are commanded."""
import time
import unittest

from harness import DONE, CanScenario, lease_pb, wait_for
from harness.client import audit_pb

DAY = 24 * 3600.0
TTL = 2.0  # s


def step(by):
    """Sets the clock; returns the time of the monotonic one, s."""
    time.clock_settime(time.CLOCK_REALTIME, time.time() + by)
    return time.monotonic()


class ClockSteps(CanScenario):
    def setUp(self):
        super().setUp()
        begun, wall = time.monotonic(), time.time()
        self.addCleanup(lambda: time.clock_settime(time.CLOCK_REALTIME, wall + time.monotonic() - begun))

    def records(self, machine, request_id):
        everything = machine.client.call(machine.client.audit.ListAudit, audit_pb.ListAuditRequest()).records
        return [record for record in everything if record.request_id == request_id]

    def test_motion_goes_on_as_it_was_told(self):
        machine = self.cell()
        for by in (DAY, -2 * DAY, DAY):
            machine.client.to_done("SetPosition", "table", position=0.0)
            move = machine.client.motion("MoveAbsolute", "table", position=720.0, velocity=180.0)
            machine.client.wait_state("table", lambda s: s.position > 90, "it is on its way")
            step(by)
            ended = machine.client.wait_ended(move)
            self.assert_command(ended, "DONE")
            self.assertAlmostEqual(machine.client.state("table").position, 720.0, delta=0.5)
            machine.client.motion("MoveVelocity", "table", velocity=90.0)
            machine.client.wait_state("table", lambda s: s.velocity > 80, "it turns")
            step(-by)
            machine.client.to_done("Stop", "table")
            self.assertFalse(machine.sim.shaft(5).moving)
            step(by)
        self.assertNotIn("a stop frame had gone out", machine.daemon.log())

    def test_what_ends_by_itself_ends_when_it_should(self):
        machine = self.cell()
        for by in (DAY, -DAY):
            lease = machine.client.call(machine.client.lease.AcquireLease, lease_pb.AcquireLeaseRequest(
                axes=["table"], ttl={"seconds": int(TTL)}))
            begun = step(by)
            machine.client.to_done("MoveRelative", "table", distance=5.0, options={"lease_token": lease.lease_token})
            self.assertLess(time.monotonic() - begun, TTL, "the scenario is void")
            self.assertTrue(machine.client.state("table").lease_holder)
            machine.client.wait_state("table", lambda s: not s.lease_holder, "the lease ends")
            self.assertAlmostEqual(time.monotonic() - begun, TTL, delta=0.5)

            machine.client.motion("Jog", "table", velocity=20.0, hold=1.0, request_id=f"jog{by}")
            machine.client.wait_state("table", lambda s: s.moving, "it jogs")
            begun = step(-by)
            machine.client.wait_state("table", lambda s: not s.moving, "the jog is over")
            self.assertLess(time.monotonic() - begun, 2.0)

    def test_no_request_is_executed_again(self):
        machine = self.cell()
        for number, by in enumerate((DAY, -2 * DAY, DAY)):
            request_id = f"once-{number}"
            move = machine.client.motion("MoveRelative", "table", wait=DONE, distance=30.0, request_id=request_id)
            starts = machine.sim.shaft(5).starts
            step(by)
            self.assertEqual(machine.client.motion("MoveRelative", "table", distance=30.0, request_id=request_id).id,
                             move.id)
            machine.daemon.terminate()
            machine.start_daemon()
            machine.client.wait_online("table")
            self.assertEqual(machine.client.motion("MoveRelative", "table", distance=30.0, request_id=request_id).id,
                             move.id)
            self.assertEqual(machine.sim.shaft(5).starts, starts)
            if not machine.client.state("table").enabled:
                machine.client.to_done("Enable", "table")

    def test_the_audit_tells_both_clocks(self):
        machine = self.cell()
        for request_id, by in (("before", 0.0), ("forth", DAY), ("back", -2 * DAY)):
            step(by)
            machine.client.to_done("MoveRelative", "table", distance=5.0, request_id=request_id)
        found = wait_for(lambda: (lambda each: each if all(len(records) == 2 for records in each) else None)(
            [self.records(machine, request_id) for request_id in ("before", "forth", "back")]), "all is told")
        at = [records[0].at.ToMicroseconds() / 1e6 for records in found]
        self.assertAlmostEqual(at[1] - at[0], DAY, delta=60)
        self.assertAlmostEqual(at[2] - at[1], -2 * DAY, delta=60)
        numbers = [record.number for records in found for record in records]
        self.assertEqual(numbers, sorted(numbers))
        uptimes = [record.uptime.ToMicroseconds() for records in found for record in records]
        self.assertEqual(uptimes, sorted(uptimes))
        self.assertLess(uptimes[-1] - uptimes[0], 60e6)


if __name__ == "__main__":
    unittest.main()
