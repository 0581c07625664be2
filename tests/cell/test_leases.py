"""Leases through entrances: they are the owner's, whichever way they are renewed; who lost one moves nothing."""
import time
import unittest

from harness import START, CallFailed, lease_pb, pb, wait_for
from harness.client import seconds
from harness.wire import WireLog
from rig import AXIS, CellClient, CellScenario

TTL = 3.0
OWNER = "press-3"


class Leases(CellScenario):
    def setUp(self):
        super().setUp()
        self.one = self.cell(members=0).start_all()
        self.direct = CellClient(self.one, OWNER, port=7443)
        self.direct.wait_online(AXIS)
        self.direct.to_done("Enable", AXIS)
        self.direct.to_done("SetPosition", AXIS, position=0.0)
        self.ways = {name: CellClient(self.one, name, OWNER) for name in ("press-1", "press-2")}
        for name in self.ways:
            client = CellClient(self.one, name)
            wait_for(lambda c=client: c.states().get(OWNER) == "PRESENT", f"{OWNER} is present at {name}")
            client.close()

    def acquire(self, way, ttl, **fields):
        client = self.ways[way]
        return client.call(client.lease.AcquireLease, lease_pb.AcquireLeaseRequest(axes=[AXIS], ttl=seconds(ttl), **fields),
                           5).lease_token

    def renew(self, way, token):
        client = self.ways[way]
        return client.call(client.lease.RenewLease, lease_pb.RenewLeaseRequest(lease_token=token), 2)

    def starts(self):
        (log,) = self.one.directory.joinpath(OWNER).glob("wire-*.log")
        return len(WireLog(str(log)).writes(START, node=1))

    def test_it_outlives_the_entrance_that_it_was_taken_through(self):
        token = self.acquire("press-1", 10)
        move = self.ways["press-1"].motion("MoveAbsolute", AXIS, position=100.0, velocity=10.0, options={"lease_token": token})
        self.one.kill("press-1", "cell")
        until = time.monotonic() + 15
        while time.monotonic() < until:
            self.renew("press-2", token)
            time.sleep(1)
        ended = self.direct.wait_ended(move)
        self.assertEqual(pb.CommandState.Name(ended.state), "COMMAND_STATE_DONE", ended)
        self.assertAlmostEqual(self.direct.state(AXIS).position, 100.0, delta=0.01)

    def test_a_holder_behind_a_cut_cable_loses_it(self):
        """By the owner's own clock; and what it says later, by whichever entrance, moves nothing."""
        stale = self.acquire("press-1", TTL)
        move = self.ways["press-1"].motion("MoveAbsolute", AXIS, position=400.0, velocity=10.0, options={"lease_token": stale})
        self.one.cut("press-1")
        state = self.direct.wait_state(AXIS, lambda s: not s.lease_holder and not s.moving, "the axis halted")
        self.assertTrue(state.enabled, state)
        ended = self.direct.wait_ended(move)
        self.assertEqual(pb.CommandState.Name(ended.state), "COMMAND_STATE_ABORTED", ended)
        token = self.acquire("press-2", 60)
        self.assertGreater(token, stale)
        done = self.ways["press-2"].to_done("MoveAbsolute", AXIS, position=10.0, options={"lease_token": token})
        self.assertEqual(pb.CommandState.Name(done.state), "COMMAND_STATE_DONE")
        starts = self.starts()
        self.one.heal("press-1")
        for way in self.ways:
            with self.assertRaises(CallFailed) as refused:
                wait_for(lambda w=way: self.asked_late(w, stale), "an answer that is not of the cable")
            self.assertEqual(refused.exception.reason, "REASON_LEASE_LOST", refused.exception)
        self.assertEqual(self.starts(), starts)
        self.assertAlmostEqual(self.direct.state(AXIS).position, 10.0, delta=0.01)

    def asked_late(self, way, token):
        """True if it was accepted; nothing while the way is cut."""
        try:
            self.ways[way].motion("MoveAbsolute", AXIS, position=300.0, options={"lease_token": token})
        except CallFailed as failed:
            if failed.code.name in ("UNAVAILABLE", "DEADLINE_EXCEEDED"):
                return False
            raise
        return True


if __name__ == "__main__":
    unittest.main()
