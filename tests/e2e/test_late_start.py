"""Nothing starts late (M31): the real daemon is held between the acceptance of a move and its start frame."""
import pathlib
import shutil
import signal
import subprocess
import time
import unittest

from harness import BLOCK, START, Scenario, axis_pb, error_pb, feeder, pb, wait_for

BOUND = 2.0  # s; start_within
# A disk that takes its time: as long as a file is there.
SLOW_DISK = """#include <stdlib.h>
#include <sys/syscall.h>
#include <unistd.h>
int fdatasync(int file) {
  while (access(getenv("STALLED_DISK"), F_OK) == 0) usleep(1000);
  return (int)syscall(SYS_fdatasync, file);
}
"""


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


class StalledDisk(Scenario):
    def test_what_waits_for_it_is_never_sent(self):
        machine = self.machine({"feeder": feeder()})
        library, stalled = machine.path("slow_disk.so"), pathlib.Path(machine.path("stalled"))
        compiler = shutil.which("clang-19") or shutil.which("cc")
        subprocess.run([compiler, "-shared", "-fPIC", "-x", "c", "-", "-o", library], input=SLOW_DISK, text=True, check=True)
        machine.start_lines()
        machine.start_daemon({"LD_PRELOAD": library, "STALLED_DISK": str(stalled)})
        client = machine.client
        client.wait_online("feeder")
        client.to_done("Enable", "feeder")
        client.to_done("SetPosition", "feeder", position=0.0)
        before, since = machine.sim.shaft(), time.monotonic_ns()
        stalled.touch()
        command = client.wait_ended(client.motion("MoveAbsolute", "feeder", position=50.0))
        self.assert_command(command, "ABORTED")
        self.assertEqual(command.cause.reason, error_pb.REASON_EXPIRED, command)
        self.assertEqual(command.cause.outcome, error_pb.OUTCOME_NOT_SENT, command)
        client.to_done("Stop", "feeder")  # waits for no disk
        stalled.unlink()
        # Nor when the disk is done: the next one is the first that starts.
        client.to_done("MoveAbsolute", "feeder", position=5.0)
        self.assertEqual(len(machine.wire.writes(START, since=since)), 1)
        self.assertEqual(machine.sim.shaft().starts - before.starts, 1)
        self.assertEqual(client.get_command(command).state, pb.COMMAND_STATE_ABORTED)


if __name__ == "__main__":
    unittest.main()
