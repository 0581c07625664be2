"""Nothing starts late (M31): the real daemon is held between the acceptance of a move and its start frame."""
import signal
import time
import unittest

from harness import BLOCK, Scenario, axis_pb, error_pb, wait_for

BOUND = 2.0  # s; start_within


class LateStart(Scenario):
    def held_before_the_start(self, machine, held):
        """A move whose start chain waits for a lost reply when the process is stopped; the command at its end."""
        before = machine.sim.shaft()
        machine.sim.control("fault drop_request count=-1 node=1 register=0x0020")  # the canary, first of the chain
        since = time.monotonic_ns()
        command = machine.client.motion("MoveAbsolute", "feeder", position=50.0)
        wait_for(lambda: [frame for frame in machine.wire.requests(since=since) if frame.address == BLOCK],
                 "the chain has begun")
        machine.daemon.process.send_signal(signal.SIGSTOP)
        machine.sim.control("fault clear")
        time.sleep(held)
        machine.daemon.process.send_signal(signal.SIGCONT)
        ended = machine.client.wait_ended(command)
        machine.sim.wait_rest()
        return ended, machine.sim.shaft().starts - before.starts

    def test_a_stopped_process_starts_nothing_when_it_goes_on(self):
        machine = self.ready_feeder()
        command, starts = self.held_before_the_start(machine, BOUND + 0.5)
        self.assert_command(command, "ABORTED")
        self.assertEqual(starts, 0, command)
        self.assertEqual(command.cause.reason, error_pb.REASON_EXPIRED, command)
        self.assertIn("too late to start", command.cause.message)
        # A fresh request is as good as ever.
        machine.client.to_done("MoveAbsolute", "feeder", position=5.0)

    def test_the_deadline_of_the_call_shortens_it(self):
        machine = self.ready_feeder()
        before = machine.sim.shaft()
        machine.sim.control("fault drop_request count=-1 node=1 register=0x0020")
        since = time.monotonic_ns()
        request = axis_pb.MoveAbsoluteRequest(axis="feeder", position=50.0, options={"request_id": "short"})
        command = machine.client.axis.MoveAbsolute(request, timeout=0.7).command  # answered at acceptance
        wait_for(lambda: [frame for frame in machine.wire.requests(since=since) if frame.address == BLOCK],
                 "the chain has begun")
        machine.daemon.process.send_signal(signal.SIGSTOP)
        machine.sim.control("fault clear")
        time.sleep(1.0)
        machine.daemon.process.send_signal(signal.SIGCONT)
        ended = machine.client.wait_ended(command)
        self.assert_command(ended, "ABORTED")
        self.assertEqual(ended.cause.reason, error_pb.REASON_EXPIRED, ended)
        self.assertEqual(machine.sim.shaft().starts, before.starts)


if __name__ == "__main__":
    unittest.main()
