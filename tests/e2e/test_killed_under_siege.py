"""SIGKILL of the daemon while its axes turn and clients misbehave: what the service starts then stops every one of them, and
nothing moves any more. How long that takes is measured by tests/bench/siege_bench.py --kill."""
import contextlib
import random
import socket
import threading
import time
import unittest

from harness import START, STARTED, STOP, Scenario, spinner

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


class KilledUnderSiege(Scenario):
    def test_every_axis_is_told_to_stop_and_nothing_starts(self):
        axes = {f"axis-{node}": spinner(node) for node in range(1, AXES + 1)}
        machine = self.machine(axes).start()
        for axis in axes:
            machine.client.to_done("Enable", axis)
            machine.client.motion("MoveVelocity", axis, velocity=2.0, wait=STARTED)
        besiegers = [Besieger(path, attack) for path in (machine.socket, machine.socket + ".stop")
                     for attack in (pings, garbage, silence)]
        try:
            while not all(each.met > 3 for each in besiegers):
                time.sleep(0.005)
            for node in range(1, AXES + 1):
                self.assertTrue(machine.sim.shaft(node).moving, node)
            killed = time.monotonic_ns()
            machine.daemon.kill()
            done = machine.quiesce()
        finally:
            for each in besiegers:
                each.close()
        self.assertEqual((done.returncode, done.stderr), (0, ""), done)
        self.assertEqual(sorted(done.stdout.splitlines()), [f"{axis}: standstill confirmed" for axis in sorted(axes)])
        for node in range(1, AXES + 1):
            self.assertFalse(machine.sim.shaft(node).moving, node)
            writes = machine.sim.wire.writes(node=node, since=killed)
            self.assertTrue(writes and all(frame.writes(STOP, 0) for frame in writes), [str(frame) for frame in writes])
        # Nor does the next start move anything.
        machine.start_daemon()
        for axis in axes:
            machine.client.wait_online(axis)
        self.assertEqual(machine.sim.wire.writes(START, since=killed), [])


if __name__ == "__main__":
    unittest.main()
