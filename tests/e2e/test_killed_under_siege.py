"""SIGKILL and SIGTERM of the daemon while its axes turn and clients misbehave: every one of them is stopped, by what the
service starts then or by the daemon itself, and nothing moves any more. How long that takes is measured by
tests/bench/siege_bench.py."""
import contextlib
import random
import socket
import threading
import time
import unittest

from harness import START, STARTED, STOP, Scenario, axis_pb, spinner

AXES = 8
PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + bytes([0, 0, 0, 4, 0, 0, 0, 0, 0])
PING = bytes([0, 0, 8, 6, 0, 0, 0, 0, 0]) + b"12345678"


class Besieger(threading.Thread):
    """Connects to an address again and again, and does the same there each time; until close()."""

    def __init__(self, path, attack):
        super().__init__(daemon=True)
        self._path, self._attack, self._open = path, attack, True
        self.met = 0  # connections that were taken
        self.start()

    def run(self):
        while self._open:
            with contextlib.suppress(OSError), socket.socket(socket.AF_UNIX) as peer:
                peer.settimeout(0.2)
                peer.connect(self._path)
                self.met += 1
                self._attack(peer)

    def close(self):
        self._open = False
        self.join()


def pings(peer):
    peer.sendall(PREFACE)
    for _ in range(1000):
        peer.sendall(PING * 200)


def garbage(peer):
    peer.sendall(random.Random(7).randbytes(4096))


def silence(peer):
    peer.recv(1)


class UnderSiege(Scenario):
    @contextlib.contextmanager
    def besieged(self):
        """A machine all of whose axes turn, and clients that misbehave at both of its addresses."""
        self.axes = {f"axis-{node}": spinner(node) for node in range(1, AXES + 1)}
        machine = self.machine(self.axes).start()
        for axis in self.axes:
            machine.client.to_done("Enable", axis)
            machine.client.motion("MoveVelocity", axis, velocity=2.0, wait=STARTED)
        reader = machine.connect()
        streams = [reader.axis.WatchAxes(axis_pb.WatchAxesRequest()) for _ in range(8)]
        for stream in streams:  # which nobody reads from then on
            next(stream)
        besiegers = [Besieger(path, attack) for path in (machine.socket, machine.socket + ".stop")
                     for attack in (pings, garbage, silence)]
        try:
            while not all(each.met > 3 for each in besiegers):
                time.sleep(0.005)
            for node in range(1, AXES + 1):
                self.assertTrue(machine.sim.shaft(node).moving, node)
            yield machine
        finally:
            for each in besiegers:
                each.close()

    def stopped_for_good(self, machine, since):
        """By nothing but stops without a ramp of their own; nor does the next start move anything."""
        for node in range(1, AXES + 1):
            self.assertFalse(machine.sim.shaft(node).moving, node)
            writes = machine.sim.wire.writes(node=node, since=since)
            self.assertTrue(writes and all(frame.writes(STOP, 0) for frame in writes), [str(frame) for frame in writes])
        machine.start_daemon()
        for axis in self.axes:
            machine.client.wait_online(axis)
        self.assertEqual(machine.sim.wire.writes(START, since=since), [])

    def test_killed_every_axis_is_told_to_stop_and_nothing_starts(self):
        with self.besieged() as machine:
            killed = time.monotonic_ns()
            machine.daemon.kill()
            done = machine.quiesce()
        self.assertEqual((done.returncode, done.stderr), (0, ""), done)
        self.assertEqual(sorted(done.stdout.splitlines()), [f"{axis}: standstill confirmed" for axis in sorted(self.axes)])
        self.stopped_for_good(machine, killed)

    def test_told_to_end_it_stops_every_axis_and_ends_in_order(self):
        with self.besieged() as machine:
            told = time.monotonic_ns()
            self.assertEqual(machine.daemon.terminate(), 0)
        self.assertRegex(machine.daemon.log(), r"(?s) info ending: SIGTERM\n.* info ended with status 0\n\Z")
        self.assertNotIn("sequences did not end", machine.daemon.log())
        self.stopped_for_good(machine, told)


if __name__ == "__main__":
    unittest.main()
