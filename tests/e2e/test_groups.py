"""Axes that start and stop together, on both kinds of bus: the demonstration's group, by axisctl and by the API."""
import json
import unittest
import uuid

from harness import AXISCTL, DONE, CallFailed, Client, Demo, error_pb, group_pb, lease_pb, pb, run, wait_for

TRANSFER = ("carousel", "feeder", "pusher")


class Groups(unittest.TestCase):
    def setUp(self):
        self.demo = Demo()
        self.addCleanup(self.demo.close)
        self.client = self.demo.client
        # What terminals can start is written to a drive without power, so the pusher needs that once.
        self.client.to_done("Disable", "pusher")
        for axis in TRANSFER:
            self.client.wait_online(axis)
        # That it follows SYNC it shows while it is released, and on a slow computer at the second attempt only.
        self.client.wait_state("carousel", lambda s: s.starts_by_sync, "the carousel is known to start by SYNC")
        for axis in TRANSFER:
            self.client.to_done("Enable", axis)
        self.client.to_done("Home", "pusher")  # its segments count from there
        for axis in ("carousel", "feeder"):
            self.client.to_done("SetPosition", axis, position=10.0)

    def axisctl(self, *words):
        return run([AXISCTL, "--server", self.demo.server, *words], limit=60)

    def move(self, targets, wait=DONE, client=None, **fields):
        client = client or self.client
        options = {"request_id": str(uuid.uuid4()), "wait_until": wait, **fields.pop("options", {})}
        request = group_pb.MoveGroupRequest(
            targets=[{"axis": axis, **target} for axis, target in targets.items()], options=options, **fields)
        return client.call(client.group.MoveGroup, request, timeout=60).move

    def test_members_on_both_buses_arrive_together(self):
        listed = self.axisctl("group", "list").stdout
        self.assertIn("transfer", listed)
        self.assertIn("50 ms", listed)
        for axis, start in {"carousel": "starts by SYNC", "feeder": "starts alone, not by SYNC: its bus has no"}.items():
            self.assertIn(start, self.axisctl("state", axis).stdout)
        done = self.axisctl("--json", "group", "move", "transfer", "feeder=110mm", "carousel=100deg", "pusher=40mm",
                            "--together", "--wait")
        self.assertEqual(done.returncode, 0, done.stderr)
        move = json.loads(done.stdout)
        self.assertEqual(move["state"], "COMMAND_STATE_DONE")
        members = {member["command"]["axis"]: member for member in move["members"]}
        self.assertEqual(sorted(members), sorted(TRANSFER))
        predicted = [float(member["predicted_duration"].removesuffix("s")) for member in members.values()]
        self.assertLess(max(predicted) - min(predicted), 0.05)
        self.assertTrue(members["carousel"]["by_sync"], members["carousel"])
        self.assertIn("start_skew", move)
        self.assertIn("arrival_error", move)
        for axis, place in {"feeder": 110, "carousel": 100, "pusher": 40}.items():
            self.assertAlmostEqual(self.client.state(axis).position, place, delta=0.05)
        for member in members.values():
            self.assertEqual(member["command"]["kind"], "COMMAND_KIND_MOVE_GROUP")
        shown = self.axisctl("group", "show", move["id"])
        self.assertIn("start skew", shown.stdout)

    def prepare(self, targets):
        request = group_pb.PrepareMoveRequest(move=group_pb.MoveGroupRequest(
            targets=[{"axis": axis, **target} for axis, target in targets.items()],
            options={"request_id": str(uuid.uuid4())}))
        return self.client.call(self.client.group.PrepareMove, request, timeout=60)

    def renew(self, move):
        request = group_pb.RenewPreparedRequest(id=move.id, all_told=True)
        return self.client.call(self.client.group.RenewPrepared, request).move

    def test_a_prepared_move_starts_at_its_moment(self):
        for targets in ({"feeder": {"position": 50.0}, "pusher": {"position": 50.0}},
                        {"feeder": {"position": 20.0}, "carousel": {"position": 40.0}}):
            prepared = self.prepare(targets)
            found = prepared.move.preparation
            self.assertEqual(prepared.move.state, pb.COMMAND_STATE_ACCEPTED, prepared.move)
            lasts = found.expires.ToNanoseconds() - prepared.clock.ToNanoseconds()
            self.assertTrue(1.5e9 < lasts <= 2e9, prepared)
            at = prepared.clock.ToNanoseconds() + found.notice.ToNanoseconds() + 300_000_000
            request = group_pb.StartPreparedRequest(id=prepared.move.id)
            request.at.FromNanoseconds(at)
            started = self.client.call(self.client.group.StartPrepared, request).move
            self.assertEqual(started.preparation.starts_at.ToNanoseconds(), at)
            self.assertFalse(started.preparation.HasField("first_start"))
            moved = wait_for(lambda m=started: self.ended(self.renew(m)), "the move ended")
            self.assertEqual(moved.state, pb.COMMAND_STATE_DONE, moved)
            late = moved.preparation.first_start.ToNanoseconds() - at
            self.assertTrue(0 <= late < 70e6, moved)  # at most 50 ms, and the frame itself
            for axis, target in targets.items():
                self.assertAlmostEqual(self.client.state(axis).position, target["position"], delta=0.05)

    def test_a_prepared_move_that_is_not_told_to_start_ends_by_itself(self):
        prepared = self.prepare({"feeder": {"position": 300.0}, "carousel": {"position": 90.0}})
        ended = wait_for(lambda: self.ended(prepared.move), "the move ended")
        self.assertEqual(ended.state, pb.COMMAND_STATE_ABORTED, ended)
        self.assertEqual(ended.cause.reason, error_pb.REASON_EXPIRED)
        for axis in ("feeder", "carousel"):
            self.assertAlmostEqual(self.client.state(axis).position, 10.0, delta=0.05)

    def test_a_prepared_move_that_is_not_renewed_is_stopped(self):
        prepared = self.prepare({"feeder": {"position": 390.0, "velocity": 20.0},
                                 "pusher": {"position": 140.0, "velocity": 20.0}})
        request = group_pb.StartPreparedRequest(id=prepared.move.id)
        request.at.FromNanoseconds(prepared.clock.ToNanoseconds() + prepared.move.preparation.notice.ToNanoseconds()
                                   + 300_000_000)
        started = self.client.call(self.client.group.StartPrepared, request).move
        wait_for(lambda: self.renew(started).state == pb.COMMAND_STATE_ACTIVE, "the move started")
        ended = wait_for(lambda: self.ended(started), "the move ended")
        self.assertEqual(ended.state, pb.COMMAND_STATE_ABORTED, ended)
        self.assertEqual(ended.cause.reason, error_pb.REASON_EXPIRED)
        for axis in ("feeder", "pusher"):
            self.client.wait_state(axis, lambda s: s.state == pb.STATE_STANDSTILL, f"{axis} rests")

    def test_a_stop_of_the_group_and_of_one_member_stops_all(self):
        for stop in (("group", "stop", "transfer"), ("group", "halt", "--axis", "feeder", "--axis", "pusher"),
                     ("stop", "pusher")):
            with self.subTest(stop):
                move = self.move({"feeder": {"position": 390.0, "velocity": 20.0},
                                  "carousel": {"distance": 150.0, "velocity": 20.0},
                                  "pusher": {"position": 140.0, "velocity": 20.0}}, wait=pb.WAIT_UNTIL_STARTED)
                self.assertEqual(move.state, pb.COMMAND_STATE_ACTIVE, move)
                for axis in TRANSFER:
                    self.assertEqual(self.client.state(axis).state, pb.STATE_SYNCHRONIZED_MOTION)
                done = self.axisctl(*stop, "--wait")
                self.assertEqual(done.returncode, 0, done.stderr)
                ended = wait_for(lambda m=move: self.ended(m), "the group move ended")
                self.assertEqual(ended.state, pb.COMMAND_STATE_ABORTED, ended)
                for axis in TRANSFER:
                    self.client.wait_state(axis, lambda s: s.state == pb.STATE_STANDSTILL, f"{axis} rests")
                self.move({"feeder": {"position": 10.0}, "pusher": {"position": 10.0}})

    def ended(self, move):
        now = self.client.call(self.client.group.GetGroupMove, group_pb.GetGroupMoveRequest(id=move.id)).move
        return now if now.state > pb.COMMAND_STATE_ACTIVE else None

    def test_what_is_known_is_stopped_though_a_name_is_not(self):
        self.client.motion("MoveAbsolute", "feeder", position=390.0, velocity=20.0)
        self.client.wait_state("feeder", lambda s: s.moving, "the feeder moves")
        response = self.client.call(self.client.group.GroupStop, group_pb.GroupStopRequest(
            group="nobody", axes=["feeder", "nothing"], wait_until=DONE))
        results = {result.name: result for result in response.results}
        self.assertEqual(results["feeder"].command.state, pb.COMMAND_STATE_DONE)
        for name in ("nobody", "nothing"):
            self.assertEqual(results[name].error.reason, error_pb.REASON_UNKNOWN_AXIS)
        self.assertFalse(self.client.state("feeder").moving)
        done = self.axisctl("group", "stop", "transfer", "--axis", "nothing")
        self.assertEqual(done.returncode, 1, done.stdout)
        with self.assertRaises(CallFailed) as caught:
            self.client.call(self.client.group.GroupHalt, group_pb.GroupHaltRequest(group="nobody"))
        self.assertEqual(caught.exception.reason, "REASON_UNKNOWN_AXIS")

    def test_a_repeat_attaches_and_a_lease_has_to_cover_every_member(self):
        other = Client(self.demo.server)
        self.addCleanup(other.close)
        grant = self.client.call(self.client.lease.AcquireLease, lease_pb.AcquireLeaseRequest(
            axes=["transfer"], ttl={"seconds": 30}))
        self.assertEqual(sorted(grant.lease.axes), sorted(TRANSFER))
        targets = {"feeder": {"distance": 5.0}, "carousel": {"distance": 5.0}}
        with self.assertRaises(CallFailed) as caught:
            self.move(targets, client=other)
        self.assertEqual(caught.exception.reason, "REASON_LEASE_REQUIRED")
        options = {"request_id": "once", "lease_token": grant.lease_token}
        first = self.move(targets, options=options)
        self.assertEqual(first.state, pb.COMMAND_STATE_DONE, first)
        self.assertEqual(self.move(targets, options=options).id, first.id)
        self.assertAlmostEqual(self.client.state("feeder").position, 15.0, delta=0.01)
        with self.assertRaises(CallFailed) as caught:
            self.move({"feeder": {"distance": 6.0}}, options=options)
        self.assertEqual(caught.exception.reason, "REASON_REQUEST_ID_CONFLICT")


if __name__ == "__main__":
    unittest.main()
