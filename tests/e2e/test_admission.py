"""A client that fills its share of remembered request ids takes nothing from another, nor its own stops; also over kills
of the daemon, and no repeat moves."""
import re
import unittest

import grpc

from certificates import Certificates
from harness import DONE, CallFailed, Client, Scenario, axis_pb, pb, spinner, wait_for

TOTAL = 1500
SHARE = 2 * TOTAL // 3  # of one client alone
AT_ONCE = 50


class Admission(Scenario):
    def setUp(self):
        super().setUp()
        self.subject = self.machine({"one": spinner(node=1), "two": spinner(node=2)})
        self.authority = Certificates(self.subject.directory, "authority")
        for name in ("server", "greedy", "hmi"):
            self.authority.issue(name)
        tls = (f"{{ certificate: {self.authority.path('crt', 'server')}, key: {self.authority.path('key', 'server')}, "
               f"client_ca: {self.authority.path('crt')} }}")
        self.subject.server = f"{{ listen: 127.0.0.1:0, tls: {tls}, limits: {{ request_ids: {TOTAL} }} }}"
        self.subject.write_config()
        self.subject.start_lines()
        self.start()

    def start(self):
        self.daemon = self.subject.start_daemon()
        port = wait_for(lambda: re.search(r"serves 'e2e' on port (\d+)", self.daemon.log()), "its port")[1]
        self.greedy, self.hmi = self.connect("greedy", port), self.connect("hmi", port)
        for axis in ("one", "two"):
            self.hmi.wait_online(axis)

    def connect(self, name, port):
        client = Client(f"127.0.0.1:{port}", grpc.ssl_channel_credentials(
            self.authority.read("crt"), self.authority.read("key", name), self.authority.read("crt", name)))
        self.addCleanup(client.close)
        return client

    def fill(self):
        """Moves to where the axis stands until these are refused; how many were taken."""
        taken = 0
        while True:
            calls = [self.greedy.axis.MoveAbsolute.future(
                axis_pb.MoveAbsoluteRequest(axis="one", position=0.0, options={"request_id": f"no-op-{taken + i}",
                                                                               "wait_until": DONE}), timeout=60)
                     for i in range(AT_ONCE)]
            failed = [call.exception() for call in calls if call.exception()]
            taken += AT_ONCE - len(failed)
            if failed:
                return taken, CallFailed(failed[0])
            self.assertLess(taken, TOTAL, "nothing is refused")

    def expect_refused(self):
        with self.assertRaises(CallFailed) as refused:
            self.greedy.motion("Enable", "one")
        self.assertEqual((refused.exception.code, refused.exception.reason),
                         (grpc.StatusCode.RESOURCE_EXHAUSTED, "REASON_BUSY"))
        self.assertRegex(refused.exception.detail.message, r"^greedy has \d+ request ids remembered, the most")
        self.assertRegex(refused.exception.detail.remedy, r"^the next is free in \d+ s; ")
        return int(re.search(r"free in (\d+) s", refused.exception.detail.remedy)[1])

    def expect_served(self):
        """The other client enables and moves; the greedy one stops that, in each way."""
        self.hmi.to_done("Enable", "two")
        self.hmi.to_done("SetPosition", "two", position=0.0)
        self.hmi.to_done("MoveRelative", "two", distance=0.25)
        for name in ("Halt", "Stop", "QuickStop"):
            move = self.hmi.motion("MoveVelocity", "two", velocity=1.0, wait=pb.WAIT_UNTIL_STARTED)
            self.assertEqual(self.greedy.motion(name, "two", wait=DONE).state, pb.COMMAND_STATE_DONE)
            self.assertEqual(self.hmi.wait_ended(move).state, pb.COMMAND_STATE_ABORTED)
        self.greedy.to_done("Disable", "two")

    def test_one_fills_its_share(self):
        self.greedy.to_done("Enable", "one")
        self.greedy.to_done("SetPosition", "one", position=0.0)
        first = self.greedy.to_done("MoveRelative", "one", distance=0.25, request_id="move")
        self.greedy.to_done("MoveAbsolute", "one", position=0.0)
        taken, failure = self.fill()
        self.assertEqual(failure.reason, "REASON_BUSY")
        self.assertAlmostEqual(taken, SHARE, delta=20)
        left = self.expect_refused()
        self.expect_served()
        for _ in range(2):
            self.daemon.kill()
            self.start()
            # Whole minutes: ids that were heard of within one are remembered together.
            self.assertLessEqual(self.expect_refused(), left, "a restart begins nothing anew")
            before = self.subject.sim.shaft(1).starts
            repeat = self.greedy.motion("MoveRelative", "one", distance=0.25, request_id="move", wait=DONE)
            self.assertEqual((repeat.id, repeat.state), (first.id, pb.COMMAND_STATE_DONE))
            self.assertEqual(self.subject.sim.shaft(1).starts, before, "a repeat moves nothing")
            self.expect_served()


if __name__ == "__main__":
    unittest.main()
