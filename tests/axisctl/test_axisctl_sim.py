"""axisctl sim against a socket that stands for the daemon's simulated drives."""
import socket
import threading
import unittest
import uuid

from support import AxisctlTest  # makes axisd importable
from axisd.v1 import system_service_pb2 as system_pb


class SimulatedDrives:
    """Answers each line, and keeps it."""

    def __init__(self, instance_id, replies):
        self.lines = []
        self.replies = replies
        self.listener = socket.socket(socket.AF_UNIX)
        self.listener.bind(f"\0axisd-sim-{instance_id}")
        self.listener.listen()
        threading.Thread(target=self.serve, daemon=True).start()

    def serve(self):
        while True:
            try:
                connection, _ = self.listener.accept()
            except OSError:
                return
            with connection, connection.makefile("rw", newline="\n") as stream:
                for line in stream:
                    self.lines.append(line.rstrip("\n"))
                    stream.write(self.replies.get(self.lines[-1], "ok") + "\n")
                    stream.flush()


class Sim(AxisctlTest):
    def setUp(self):
        super().setUp()
        instance = str(uuid.uuid4())
        self.server.answers["GetInfo"] = system_pb.GetInfoResponse(instance_id=instance)
        self.drives = SimulatedDrives(instance, {
            "axis feeder show": "ok the load is at 12.5 mm, at rest, 3 starts",
            "axis ghost power off": "error bus 'line-b' is not simulated; only drives on a bus with port: sim take this"})
        self.addCleanup(self.drives.listener.close)

    def test_each_command_reaches_the_drives(self):
        for words, line in ((("input", "feeder", "X1", "on"), "axis feeder input X1 on"),
                            (("input", "feeder", "X1", "auto"), "axis feeder input X1 auto"),
                            (("alarm", "feeder", "2"), "axis feeder alarm 2"),
                            (("block", "feeder", "on"), "axis feeder block on"),
                            (("push", "feeder", "-1.2cm"), "axis feeder push -12"),
                            (("lose", "feeder", "3"), "axis feeder lose 3"),
                            (("cut", "line-a"), "bus line-a cut"),
                            (("join", "line-a"), "bus line-a join"),
                            (("clear", "line-a"), "bus line-a clear")):
            self.ok("sim", *words)
            self.assertEqual(self.drives.lines[-1], line)

    def test_a_power_cycle_is_off_and_on(self):
        self.assertEqual(self.ok("sim", "power", "feeder", "cycle"), "feeder: power cycle\n")
        self.assertEqual(self.drives.lines, ["axis feeder power off", "axis feeder power on"])
        self.assertEqual(self.json("sim", "power", "feeder", "cycle"),
                         [{"name": "feeder", "command": "power cycle", "reply": ""}])

    def test_what_they_reply(self):
        self.assertEqual(self.ok("sim", "show", "feeder"), "feeder: the load is at 12.5 mm, at rest, 3 starts\n")
        self.assertEqual(self.json("sim", "show", "feeder"), [
            {"name": "feeder", "command": "show", "reply": "the load is at 12.5 mm, at rest, 3 starts"}])
        self.assertEqual(self.fails(4, "sim", "power", "ghost", "off"),
                         "axisctl: ghost: bus 'line-b' is not simulated; only drives on a bus with port: sim take this")

    def test_bad_words_reach_nobody(self):
        self.fails(2, "sim", "input", "feeder", "X1", "pressed")
        self.assertIn("did you mean 'power'?", self.fails(2, "sim", "powr", "feeder", "off"))
        self.fails(2, "sim", "push", "feeder", "5deg")
        self.assertEqual(self.drives.lines, [])

    def test_a_daemon_without_simulated_drives(self):
        self.server.answers["GetInfo"] = system_pb.GetInfoResponse(instance_id=str(uuid.uuid4()))
        self.assertRegex(self.fails(3, "sim", "show", "feeder"),
                         "the simulated drives do not answer: Connection refused; this works on the daemon's own computer")


if __name__ == "__main__":
    unittest.main()
