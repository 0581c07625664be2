"""The end of the daemon when something else is wrong, too: it ends in order, with the status that fits."""
import os
import pathlib
import re
import resource
import signal
import subprocess
import time
import unittest

from harness import AXISD, STOP, Scenario, feeder, pb, spinner, wait_for


class LostPort(Scenario):
    def test_at_rest(self):
        machine = self.ready_feeder()
        machine.sim.control("hangup")
        machine.client.wait_state("feeder", lambda s: s.link == pb.LINK_STATE_OFFLINE, "offline")
        self.assertEqual(machine.daemon.terminate(), 0, machine.daemon.log())
        self.assertRegex(machine.daemon.log(), r" info ended with status 0\n\Z")

    def test_in_motion(self):
        """Nobody can tell whether it has stopped: that is told, and in the status, too."""
        machine = self.ready_spinner()
        machine.client.motion("MoveVelocity", "spinner", velocity=5.0, wait=pb.WAIT_UNTIL_STARTED)
        machine.sim.wait_moving()
        machine.sim.control("hangup")
        machine.client.wait_state("spinner", lambda s: s.link == pb.LINK_STATE_OFFLINE, "offline")
        self.assertEqual(machine.daemon.terminate(), 1, machine.daemon.log())
        self.assertIn("not every axis has confirmed its standstill", machine.daemon.log())
        self.assertRegex(machine.daemon.log(), r" info ended with status 1\n\Z")


class Impatient(Scenario):
    def test_further_signals_hurry_nothing(self):
        """While the standstill of what moved is still to be confirmed."""
        machine = self.ready_spinner()
        machine.client.motion("MoveVelocity", "spinner", velocity=5.0, wait=pb.WAIT_UNTIL_STARTED)
        machine.sim.wait_moving()
        machine.sim.control("fault drop_request count=-1 node=1")
        for number in (signal.SIGINT, signal.SIGTERM):
            machine.daemon.process.send_signal(number)
            wait_for(lambda: "stopping what moves: spinner" in machine.daemon.log(), "it ends")
            self.assertTrue(machine.daemon.running())
        machine.daemon.process.send_signal(signal.SIGINT)
        machine.sim.control("fault clear")
        self.assertEqual(machine.daemon.wait(), 0, machine.daemon.log())
        self.assertFalse(machine.sim.shaft().moving)


class DeafLog(Scenario):
    def test_nobody_reads_it(self):
        """The reader of a pipe has gone: the machine goes on, and ends in order."""
        machine = self.machine({"feeder": feeder()})
        machine.start_lines()
        reader, writer = os.pipe()
        os.close(reader)
        words = [AXISD, "--config", machine.config, "--wire-log", str(machine.wire.path), "--log-level", "debug"]
        with subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=writer, stderr=writer) as daemon:
            os.close(writer)
            wait_for(lambda: pathlib.Path(machine.socket).exists(), "it serves")
            client = machine.client
            client.wait_online("feeder")
            client.to_done("Enable", "feeder")
            client.to_done("SetPosition", "feeder", position=0.0)
            client.motion("MoveAbsolute", "feeder", position=300.0, wait=pb.WAIT_UNTIL_STARTED)
            machine.sim.wait_moving()
            at = time.monotonic_ns()
            daemon.send_signal(signal.SIGTERM)
            self.assertEqual(daemon.wait(60), 0)
        self.assertTrue(machine.wire.writes(STOP, 0, since=at))
        self.assertFalse(machine.sim.shaft().moving)


# UndefinedBehaviorSanitizer looks at memory through a pipe, and reports what it cannot look at.
FEWEST = 12 if os.environ.get("AXISD_SANITIZE") else 4


class FewDescriptors(Scenario):
    """Whichever one it is that is not to be had: no crash, and it is told what is missing."""

    def setUp(self):
        super().setUp()
        self.subject = self.machine({"feeder": feeder(1), "other": spinner(1, bus="second")})
        config = pathlib.Path(self.subject.config)
        text = config.read_text()
        for bus in self.subject.buses():
            text = text.replace(f"port: {self.subject.path(bus)},", "port: sim,")
        config.write_text(text)

    def limited(self, count, *words):
        """With at most `count` descriptors: whether it served before it was told to end, its status, and its log."""
        def limit():
            resource.setrlimit(resource.RLIMIT_NOFILE, (count, count))
        log = pathlib.Path(self.subject.path(f"limited-{count}.stderr"))
        with log.open("wb") as err, subprocess.Popen(
                [AXISD, *words], stdin=subprocess.DEVNULL, stdout=err, stderr=err, preexec_fn=limit) as daemon:
            wait_for(lambda: daemon.poll() is not None or " serves 'e2e'" in log.read_text(errors="replace"), "it ends or serves")
            served = daemon.poll() is None
            if served:
                daemon.send_signal(signal.SIGTERM)
            return served, daemon.wait(60), log.read_text(errors="replace")

    def test_at_the_start(self):
        for count in (*range(FEWEST, 13), 16, 24, 32, 48, 64, 100):
            served, status, log = self.limited(count, "--config", self.subject.config)
            self.assertEqual((served, status), (False, 2), f"{count} descriptors:\n{log}")
            self.assertTrue(log, count)
        self.assertIn("only 100 file descriptors may be open at a time", log)
        self.assertIn("LimitNOFILE", log)
        needed = int(re.search(r"and (\d+) may be needed", log)[1])
        served, status, log = self.limited(needed, "--config", self.subject.config)
        self.assertEqual((served, status), (True, 0), log)

    def test_quiesce(self):
        """Which needs few, and says so where it has not even these."""
        for count in range(FEWEST, 40):
            _, status, log = self.limited(count, "--quiesce", self.subject.config)
            self.assertIn(status, (0, 1, 2), f"{count} descriptors:\n{log}")
            self.assertTrue(log, count)
        self.assertEqual(status, 0, log)


if __name__ == "__main__":
    unittest.main()
