"""The daemon's log: its level while it runs, and what clients can make of it."""
import os
import pathlib
import re
import socket
import unittest

from harness import CallFailed, Scenario, feeder, wait_for

#: A file system of its own, in which a folder of the test is the journal's.
WITH_JOURNAL_IN = ("mount -t tmpfs none /run && mkdir -p /run/systemd/journal && "
                   "mount --bind {folder} /run/systemd/journal && exec \"$@\"")


class Level(Scenario):
    def test_is_changed_while_axes_move(self):
        machine = self.ready_feeder()
        self.move_under_way(machine, beyond=2.0, velocity=20.0)
        self.assertEqual(machine.axisctl("log-level").stdout, "info\n")
        self.assertEqual(machine.axisctl("log-level", "debug").returncode, 0)
        wait_for(lambda: "the log has level debug now, and had info\n" in machine.daemon.log(), "the change is told")
        machine.axisctl("watch", "feeder", "--count", "1")
        wait_for(lambda: " debug " in machine.daemon.log(), "it says more")
        self.assertEqual(machine.axisctl("log-level", "error").returncode, 0)
        wait_for(lambda: "the log has level error now, and had debug\n" in machine.daemon.log(), "the change is told")
        machine.client.to_done("Stop", "feeder")
        self.assertEqual(machine.axisctl("log-level", "info").returncode, 0)
        wait_for(lambda: all(f"the log has level {level} now" in machine.axisctl("audit", "--kind", "call").stdout
                             for level in ("debug", "error", "info")), "each change has a record")
        # Of what happened meanwhile there is nothing.
        between = machine.daemon.log().split("the log has level error now")[1].split("the log has level info now")[0]
        self.assertNotIn(" info ", between.split("\n", 1)[1].rsplit("\n", 1)[0])


class Journal(Scenario):
    def test_lines_of_text_where_stderr_goes_elsewhere(self):
        """JOURNAL_STREAM is inherited, also by whoever sends standard error to a file."""
        machine = self.machine({"feeder": feeder()})
        machine.start_lines()
        daemon = machine.start_daemon({"JOURNAL_STREAM": "8:1234567"})
        machine.client.wait_online("feeder")
        wait_for(lambda: " info feeder: online (" in daemon.log(), "it is told")
        self.assertNotRegex(daemon.log(), "AXISD_|[\x1e\x1f]")

    def test_lines_of_text_while_nobody_takes_them(self):
        """Standard error is the journal's, and the journal does not run, or not any more."""
        machine = self.machine({"feeder": feeder()})
        folder = pathlib.Path(machine.path("journal"))
        folder.mkdir()
        machine.start_lines()
        stderr = pathlib.Path(machine.path("axisd-0.stderr"))
        stderr.touch()
        found = stderr.stat()
        unshare = ["unshare", "--mount", *(() if os.getuid() == 0 else ("--user", "--map-root-user"))]
        daemon = machine.start_daemon({"JOURNAL_STREAM": f"{found.st_dev}:{found.st_ino}"},
                                      before=[*unshare, "sh", "-c", WITH_JOURNAL_IN.format(folder=folder), "sh"])
        machine.client.wait_online("feeder")
        wait_for(lambda: "<6>feeder: online (" in daemon.log(), "it is told without a journal")

        journal = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.addCleanup(journal.close)
        journal.bind(str(folder / "socket"))
        journal.settimeout(60)
        before = daemon.log()
        self.assertEqual(machine.axisctl("log-level", "debug").returncode, 0)
        while b"\nAXISD_EVENT=log_level_changed\n" not in (line := journal.recv(65536)):
            pass
        self.assertIn(b"\nMESSAGE_ID=", line)
        self.assertEqual(daemon.log(), before)
        self.assertEqual(machine.axisctl("log-level", "info").returncode, 0)
        while b"the log has level info now" not in journal.recv(65536):
            pass

        journal.close()
        self.assertEqual(machine.axisctl("log-level", "debug").returncode, 0)
        wait_for(lambda: "the log has level debug now" in daemon.log(), "it is told after the journal has gone")
        self.assertNotRegex(daemon.log(), "AXISD_|[\x1e\x1f]")


class Floods(Scenario):
    def test_refused_calls_are_counted_instead_of_written(self):
        machine = self.machine({"feeder": feeder()}).start()
        for _ in range(200):
            with self.assertRaises(CallFailed):
                machine.client.motion("MoveAbsolute", "nobody", position=1.0)
        told = sum(" refused: " in line and "nobody" in line for line in machine.daemon.log().splitlines())
        self.assertLess(told, 120, "50 of a client and a kind in 10 s, at most two periods")
        left_out = r" warning [^\n]*: refused calls: \d+ more like this in the last 10 s\n"
        wait_for(lambda: re.search(left_out, machine.daemon.log()), "the others are counted")

    def test_renewals_are_not_written(self):
        machine = self.ready_feeder()
        jog = {"velocity": 5.0, "hold": 2.0, "request_id": "jog"}
        machine.client.motion("Jog", "feeder", **jog)
        written = len(machine.daemon.log().splitlines())
        for _ in range(50):
            machine.client.motion("Jog", "feeder", **jog)
        machine.client.to_done("Halt", "feeder")
        wait_for(lambda: any("halt" in line.lower() for line in machine.daemon.log().splitlines()[written:]),
                 "the halt is told")
        self.assertLess(len(machine.daemon.log().splitlines()), written + 10, machine.daemon.log())


if __name__ == "__main__":
    unittest.main()
