"""SIGTERM and SIGKILL in mid-move, starts that fail, --quiesce, and the systemd protocol."""
import pathlib
import re
import signal
import socket
import time
import unittest

from harness import AXISD, START, STOP, Scenario, feeder, frozen, own_host, pb, run, spinner, wait_for


class Terminated(Scenario):
    def test_in_mid_move(self):
        machine = self.ready_feeder()
        self.move_under_way(machine, velocity=30.0)
        at = time.monotonic_ns()
        self.assertEqual(machine.daemon.terminate(), 0)
        self.assertRegex(machine.daemon.log(), r"(?s) info ending: SIGTERM\n.* info stopping what moves: feeder\n.*"
                                               r" info ended with status 0\n\Z")
        self.assertFalse(machine.sim.shaft().moving)
        self.assertLess(machine.sim.shaft().position, 590000)
        stops = [frame.values for frame in machine.wire.writes(STOP, since=at)]
        self.assertTrue(stops)
        self.assertTrue(all(values == [0] for values in stops), "a soft stop, again only where it was not answered")
        self.assertEqual(machine.sim.peek(0x0007) >> 4 & 1, 0, "the power stage is left on")
        # The next start finds it at rest and moves nothing.
        machine.start_daemon()
        state = machine.client.wait_online("feeder")
        self.assert_state(state, "STANDSTILL")
        self.assertEqual((state.enabled, state.enabled_by_daemon), (True, False))
        self.assertEqual(machine.wire.writes(START, since=at), [])
        # Its continuity is proven, so the position still counts.
        self.assertEqual(state.trust, pb.POSITION_TRUST_RESTORED)
        self.assertAlmostEqual(state.position, machine.sim.shaft().position / 2000)

    def test_interrupt_in_velocity(self):
        machine = self.ready_spinner()
        machine.client.motion("MoveVelocity", "spinner", velocity=5.0)
        machine.sim.wait_moving()
        machine.daemon.process.send_signal(signal.SIGINT)
        self.assertEqual(machine.daemon.wait(), 0)
        self.assertIn(" info ending: SIGINT\n", machine.daemon.log())
        self.assertFalse(machine.sim.shaft().moving)


class NotStarted(Scenario):
    """Starts that fail while simulated lines and their workers run already: in order, with a status that says whether
    trying again may help."""

    def setUp(self):
        super().setUp()
        self.subject = self.machine({"feeder": feeder(1), "other": spinner(1, bus="second")})
        self.simulate(self.subject)

    def simulate(self, machine):
        config = pathlib.Path(machine.config)
        text = config.read_text()
        for bus in machine.buses():
            text = text.replace(f"port: {machine.path(bus)},", "port: sim,")
        config.write_text(text)

    def ends(self, status, words, *options, machine=None):
        """Several times: whether a thread is still busy at the end is a matter of luck."""
        for _ in range(3):
            daemon = (machine or self.subject).start_daemon(wait=False, options=options)
            self.assertEqual(daemon.wait(), status, daemon.log())
            self.assertRegex(daemon.log(), rf"(?s) critical [^\n]*{words}[^\n]*\n(.*\n)?[^\n]* info ended with status {status}\n\Z")
        self.assertNotIn("READY=1", (machine or self.subject).notify.received())

    def test_address_in_use(self):
        host = own_host()  # the port for stops is the next one: nobody else takes that there
        with socket.socket() as taken:
            taken.bind((host, 0))
            taken.listen()
            address = f"{host}:{taken.getsockname()[1]}"
            self.ends(1, f"{address}: cannot bind: Address already in use", "--listen", address)

    def test_a_command_line_that_is_judged_before_anything_opens(self):
        for option, value, words in (
                ("--listen", "127.0.0.1:80x", "'127.0.0.1:80x' is no address"),
                ("--listen", "localhost", "'localhost' is no address"),
                ("--listen", "127.0.0.1:70000", "'127.0.0.1:70000' is no address"),
                ("--listen", "unix:axisd.sock", "'unix:axisd.sock' is no address"),
                ("--listen", "127.0.0.1:65535", "there is no port after 65535"),
                ("--state-directory", "state", "'state' is no absolute path")):
            with self.subTest(value=value):
                done = run([AXISD, "--config", self.subject.config, option, value])
                self.assertEqual((done.returncode, done.stdout), (2, ""), done)
                self.assertIn(words, done.stderr)
                self.assertEqual(len(done.stderr.splitlines()), 1, "nothing was opened")

    def test_plaintext_by_the_command_line(self):
        self.ends(2, "plaintext is refused", "--listen", "0.0.0.0:0")

    def test_wire_log_that_cannot_be_written(self):
        self.subject.wire.path = f"{self.subject.config}/wire.log"
        self.ends(1, self.subject.wire.path)

    def test_state_directory_in_use(self):
        self.subject.start_daemon()
        second = self.machine({"feeder": feeder(1)})
        self.simulate(second)
        self.ends(1, self.subject.state_directory, "--state-directory", self.subject.state_directory, machine=second)

    def test_a_signal_in_the_start(self):
        for _ in range(3):
            daemon = self.subject.start_daemon(wait=False)
            wait_for(lambda: "budget of" in daemon.log(), "it has begun")
            self.assertEqual(daemon.terminate(), 0)
            self.assertRegex(daemon.log(), r" info ended with status 0\n\Z")


class Killed(Scenario):
    def test_velocity_then_quiesce(self):
        axes = {"spinner": spinner(1), "idle": feeder(2), "other": spinner(3, bus="second")}
        machine = self.machine(axes).start()
        for axis in ("spinner", "other"):
            machine.client.to_done("Enable", axis)
            machine.client.motion("MoveVelocity", axis, velocity=5.0, wait=pb.WAIT_UNTIL_STARTED)
        machine.lines["line"].wait_moving(1)
        machine.lines["second"].wait_moving(3)
        machine.daemon.kill()
        self.assertTrue(machine.lines["line"].shaft(1).moving)
        done = machine.quiesce()
        self.assertEqual((done.returncode, done.stderr), (0, ""), done)
        self.assertEqual(sorted(done.stdout.splitlines()),
                         ["idle: standstill confirmed", "other: standstill confirmed", "spinner: standstill confirmed"])
        for line, node in (("line", 1), ("line", 2), ("second", 3)):
            self.assertFalse(machine.lines[line].shaft(node).moving)

    def test_restart_stops_what_moves(self):
        machine = self.ready_spinner()
        machine.client.motion("MoveVelocity", "spinner", velocity=5.0, wait=pb.WAIT_UNTIL_STARTED)
        machine.sim.wait_moving()
        machine.daemon.kill()
        restarted = time.monotonic_ns()
        machine.start_daemon()
        machine.client.wait_online("spinner")
        self.assertFalse(machine.sim.shaft().moving)
        writes = machine.wire.writes(node=1, since=restarted)
        self.assertTrue(writes[0].writes(STOP, 0), [str(frame) for frame in writes[:5]])
        self.assertEqual(machine.wire.writes(START, since=restarted), [])

    def test_quiesce_says_what_it_could_not_do(self):
        machine = self.machine({"dead": feeder(1), "spinner": spinner(2)})
        machine.start_lines()
        machine.sim.control("power 1 off")
        done = machine.quiesce()
        self.assertEqual(done.returncode, 1)
        dead, alive = sorted(done.stdout.splitlines())
        self.assertEqual(alive, "spinner: standstill confirmed")
        self.assertRegex(dead, r"\Adead: (?!standstill).+")

    def test_quiesce_without_a_port(self):
        machine = self.machine({"feeder": feeder()})
        done = machine.quiesce()
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stdout, r"\Afeeder: .*" + machine.path("line"))

    def test_quiesce_with_a_broken_file(self):
        machine = self.ready_spinner()
        machine.client.motion("MoveVelocity", "spinner", velocity=5.0, wait=pb.WAIT_UNTIL_STARTED)
        machine.sim.wait_moving()
        machine.daemon.kill()
        with open(machine.config, "a") as file:
            file.write("nonsense: 1\n")
        done = run([AXISD, "--quiesce", machine.config, "--state-directory", machine.state_directory])
        self.assertEqual((done.returncode, done.stdout), (0, "spinner: standstill confirmed\n"), done)
        self.assertIn("nonsense", done.stderr)
        self.assertIn("last-good.yaml", done.stderr)
        self.assertFalse(machine.sim.shaft().moving)


    def test_quiesce_without_any_usable_file(self):
        machine = self.machine({"feeder": feeder()})
        done = run([AXISD, "--quiesce", machine.path("nothere.yaml"), "--state-directory", machine.state_directory])
        self.assertEqual((done.returncode, done.stdout), (2, ""), done)
        missing, using, last, end = done.stderr.splitlines()
        self.assertIn("nothere.yaml: cannot be read", missing)
        self.assertIn("using the last configuration that was served", using)
        self.assertIn("last-good.yaml: cannot be read", last)
        self.assertIn("nothing was stopped", end)


class Systemd(Scenario):
    def test_protocol(self):
        machine = self.machine({"feeder": feeder()})
        machine.start_lines()
        daemon = machine.start_daemon({"WATCHDOG_USEC": "1000000"}, wait=False)
        machine.notify.wait_for("READY=1", daemon)
        # The port is served at that moment: no retry here.
        with socket.socket(socket.AF_UNIX) as probe:
            probe.connect(machine.socket)
        self.assertEqual(machine.client.info().machine, "e2e")
        for _ in range(3):
            machine.notify.forget()
            machine.notify.wait_for("WATCHDOG=1", daemon)
        self.assertNotIn("STOPPING=1", machine.notify.received())
        daemon.process.send_signal(signal.SIGHUP)  # neither ends it nor touches what is the same
        machine.notify.forget()
        machine.notify.wait_for("WATCHDOG=1", daemon)
        wait_for(lambda: "SIGHUP" in daemon.log(), "the signal is logged")
        machine.client.wait_online("feeder")
        machine.notify.forget()
        self.assertEqual(daemon.terminate(), 0)
        self.assertNotIn("stopping what moves", daemon.log())
        machine.notify.wait_for("STOPPING=1", daemon)
        self.assertNotIn("READY=1", machine.notify.received())

    def test_is_told_when_clients_get_no_answer(self):
        """Whatever it is that answers them: the watchdog hears nothing until it goes on."""
        machine = self.machine({"feeder": feeder()})
        machine.start_lines()
        daemon = machine.start_daemon({"WATCHDOG_USEC": "1000000"}, wait=False)
        machine.notify.wait_for("WATCHDOG=1", daemon)
        pid = daemon.process.pid
        for thread, told in (("nexting_thread", "no answer for clients: .*main server"),
                             ("axisd-stops", "no progress: .*stop lane|no answer for clients: .*stop lane"),
                             ("axisd-core", "no progress: .*core")):
            at = len(daemon.log())
            machine.notify.forget()
            with frozen(pid, thread):
                def silent():
                    return re.search(f" critical .*({told})", daemon.log()[at:])
                wait_for(silent, f"{thread} is missed")
                if thread != "nexting_thread":  # stops go on without that one
                    machine.notify.wait_for("WATCHDOG=trigger", daemon)
                machine.notify.forget()
                lines = len(daemon.log().splitlines())
                wait_for(lambda: len(daemon.log().splitlines()) > lines + 2, "it is looked at again, and again")
                self.assertNotIn("WATCHDOG=1", machine.notify.received())
            machine.notify.wait_for("WATCHDOG=1", daemon)
        self.assertEqual(daemon.terminate(), 0, daemon.log())

    def test_no_ready_without_the_port(self):
        machine = self.machine({"feeder": feeder()}).start()
        second = self.machine({"feeder": feeder()}, server=f'{{ listen: "unix:{machine.socket}" }}')
        daemon = second.start_daemon(wait=False)
        self.assertEqual(daemon.wait(), 1)
        self.assertNotIn("READY=1", second.notify.received())
        self.assertIn(machine.socket, daemon.log())
        self.assertEqual(machine.client.info().machine, "e2e")


if __name__ == "__main__":
    unittest.main()
