"""Why an axis cannot move: the list, and that the lines in it for a shell are the way out."""
import re
import shlex
import unittest

from harness import START, CallFailed, Scenario, axis_pb, error_pb, feeder, lease_pb, system_pb

MOVE = {"move_absolute": axis_pb.MoveAbsoluteRequest(position=10.0)}


def name(reason):
    return error_pb.Reason.Name(reason).removeprefix("REASON_")


class Explain(Scenario):
    def obstacles(self, machine, client=None, **question):
        """As (reason, blocking); the first that blocks is what the move itself is refused with."""
        client = client or machine.client
        found = client.call(client.system.Explain, system_pb.ExplainRequest(axis="feeder", **question)).obstacles
        blocking = [obstacle.detail for obstacle in found if obstacle.blocking]
        if "move_absolute" in question and blocking:
            with self.assertRaises(CallFailed) as refused:
                options = {"lease_token": question["lease_token"]} if "lease_token" in question else None
                client.motion("MoveAbsolute", "feeder", position=question["move_absolute"].position, options=options)
            self.assertEqual((refused.exception.detail.reason, refused.exception.detail.remedy),
                             (blocking[0].reason, blocking[0].remedy))
        return [(name(obstacle.detail.reason), obstacle.blocking) for obstacle in found]

    def way_out(self, machine, token=""):
        """Does what the first obstacle's line for a shell says, until the move is permitted; the lines."""
        lines = []
        while len(lines) < 10:
            lease = ("--lease", token) if token else ()
            done = machine.axisctl("explain", "feeder", "move", "10mm", *lease)
            if done.returncode == 0:
                return lines, token
            self.assertEqual((done.returncode, done.stderr), (4, ""))
            line = re.search(r"  refused .*\n +-> .*?(axisctl [^;:,()\n]+)", done.stdout)
            self.assertTrue(line, done.stdout)
            words = shlex.split(line[1])[1:]
            lines.append(" ".join(words))
            waits = ("--wait",) if words[0] in ("enable", "home") else ()
            held = lease if words[0] in ("enable", "home", "reset") else ()
            leasing = words[:2] == ["lease", "acquire"]
            done = machine.axisctl(*words, *waits, *held, *(("--ttl", "60s") if leasing else ()))
            self.assertEqual(done.returncode, 0, f"{words}: {done.stderr}")
            if leasing:
                token = done.stdout.split()[0]
        self.fail(f"no way out: {lines}")

    def test_the_lines_in_it_lead_to_a_move(self):
        machine = self.machine({"feeder": feeder()}).start()
        client = machine.client
        self.assertEqual(self.obstacles(machine, **MOVE), [("DISABLED", True), ("NOT_TRUSTED", True)])
        self.assertEqual(self.way_out(machine)[0], ["enable feeder", "home feeder"])
        self.assertEqual(self.obstacles(machine, **MOVE), [])

        client.to_done("Stop", "feeder", hold=True, request_id="door")
        client.call(client.system.StopAll, system_pb.StopAllRequest(wait_until="WAIT_UNTIL_DONE"))
        client.call(client.lease.AcquireLease,
                    lease_pb.AcquireLeaseRequest(axes=["feeder"], label="panel 2", ttl={"seconds": 60}))
        self.assertEqual(self.obstacles(machine, **MOVE),
                         [("INHIBITED", True), ("LEASE_REQUIRED", True), ("STOPPING", True)])
        lines, token = self.way_out(machine)
        self.assertEqual(lines, ["release-stop --all", "lease acquire feeder --take", "release-stop feeder --request-id door"])
        starts = len(machine.wire.writes(START))
        done = machine.axisctl("move", "feeder", "10mm", "--wait", "--lease", token)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(len(machine.wire.writes(START)), starts + 1)

    def test_values_and_motion_in_progress(self):
        machine = self.ready_feeder()
        found = machine.client.call(machine.client.system.Explain, system_pb.ExplainRequest(
            axis="feeder", move_absolute=axis_pb.MoveAbsoluteRequest(position=500.0, velocity=5000.0))).obstacles
        self.assertEqual([(name(o.detail.reason), o.detail.permitted.maximum) for o in found],
                         [("OUT_OF_RANGE", 100), ("SOFT_LIMIT", 400)])
        self.move_under_way(machine)
        self.assertEqual(self.obstacles(machine, **MOVE), [("MOVING", False)])
        self.assertEqual(self.obstacles(machine, move_relative=axis_pb.MoveRelativeRequest(distance=1.0)),
                         [("MOVING", True)])

    def test_a_silent_drive_an_alarm_and_an_unknown_outcome(self):
        machine = self.ready_feeder()
        move = self.move_under_way(machine)
        machine.sim.control("cut")
        self.assert_command(machine.client.wait_ended(move), "UNKNOWN")
        found = self.obstacles(machine, **MOVE)
        self.assertEqual(found[:2], [("FAULT", True), ("OFFLINE", True)])
        self.assertIn(("STOPPING", False), found)
        machine.sim.control("join")
        machine.client.wait_online("feeder")
        machine.sim.wait_rest()
        (fault,) = [o.detail for o in machine.client.call(
            machine.client.system.Explain, system_pb.ExplainRequest(axis="feeder")).obstacles if o.blocking]
        self.assertRegex(fault.message, "in ErrorStop: .*unknown")
        self.assertIn("axisctl reset feeder, which reads the drive back", fault.remedy)
        machine.client.to_done("Reset", "feeder")
        machine.sim.control("alarm 1 5")
        machine.client.wait_state("feeder", lambda s: s.alarm_code == 5, "the alarm")
        self.assertEqual(self.obstacles(machine, reset=axis_pb.ResetRequest())[-1:], [("ALARM", True)])


if __name__ == "__main__":
    unittest.main()
