"""Clients that go on whatever happens, and what must be true of them afterwards: no command twice, none refused."""
import itertools
import random
import threading
import time
import uuid

from harness import DONE, CallFailed, axis_pb, pb
from harness.wire import START, WireLog

from .entrance import CellClient

#: With these nobody knows whether it was carried out, or it was not: the same request is asked again elsewhere.
AGAIN = ("UNAVAILABLE", "DEADLINE_EXCEEDED", "CANCELLED")
AXIS = "spindle-1"
NODE = 1
STEP = 1.0  # mm


class _Going(threading.Thread):
    """Repeats step() until it is told to end."""

    def __init__(self):
        super().__init__(daemon=True)
        self.ending = threading.Event()
        self.failures = []  # (when, what)

    def run(self):
        while not self.ending.is_set():
            try:
                self.step()
            except Exception as error:  # it is what the test looks at
                self.failures.append((time.monotonic(), error))
                self.ending.wait(0.2)

    def end(self):
        self.ending.set()
        self.join(120)
        assert not self.is_alive(), f"{self} hangs"


class Reader(_Going):
    """Reads one machine through one entrance, five times a second."""

    def __init__(self, cell, entrance, machine):
        super().__init__()
        self.name = f"reader of {machine} at {entrance}"
        self.client, self.answers = CellClient(cell, entrance, machine), 0

    def step(self):
        self.client.call(self.client.axis.GetAxis, axis_pb.GetAxisRequest(axis=AXIS), 5)
        self.answers += 1
        self.ending.wait(0.2)


class Mover(_Going):
    """Moves one axis on and on by one step, through all entrances in turn: each request until it is known what became of
    it, some of them once more."""

    def __init__(self, cell, machine, seed):
        super().__init__()
        self.name, self.machine, self.dice = f"mover of {machine}", machine, random.Random(seed)
        self.cell = cell
        self.ways = itertools.cycle([CellClient(cell, entrance, machine) for entrance in cell.machines])
        self.done, self.asked, self.repeated, self.position = 0, 0, 0, -400.0

    def make_ready(self):
        client = CellClient(self.cell, self.machine, port=7443)
        client.wait_online(AXIS)
        client.to_done("Enable", AXIS)
        client.to_done("SetPosition", AXIS, position=self.position)
        return self

    def ask(self, request_id, distance):
        """The command, however often it takes."""
        request = axis_pb.MoveRelativeRequest(axis=AXIS, distance=distance, velocity=100.0,
                                              options={"request_id": request_id, "wait_until": DONE})
        since = None
        while True:
            way = next(self.ways)
            self.asked += 1
            try:
                return way.call(way.axis.MoveRelative, request, timeout=4).command
            except CallFailed as failed:
                if failed.code.name not in AGAIN:
                    raise
                # Also when the test ends, it has to be found out.
                since = since or time.monotonic()
                if time.monotonic() - since > 90:
                    raise AssertionError(f"{self.machine}: not known what became of {request_id}: {failed}") from None
                time.sleep(0.05)

    def step(self):
        request_id = str(uuid.UUID(int=self.dice.getrandbits(128)))
        distance = STEP if self.done // 500 % 2 == 0 else -STEP  # to and fro, within its limits
        command = self.ask(request_id, distance)
        assert command.state == pb.COMMAND_STATE_DONE, command
        self.done += 1
        self.position += distance
        if self.dice.random() < 0.3:
            again = self.ask(request_id, distance)
            self.repeated += 1
            assert again.id == command.id, f"{command}\nmoved again as\n{again}"
        self.ending.wait(0.05)

    def judge(self, test):
        """After end(): the shaft, the daemon's count and the wire agree with what was answered."""
        client = CellClient(self.cell, self.machine, port=7443)
        test.assertEqual(self.failures, [], self.name)
        test.assertGreater(self.done, 0, self.name)
        test.assertAlmostEqual(client.state(AXIS).position, self.position, delta=0.01, msg=self.name)
        starts = 0
        for log in self.cell.directory.joinpath(self.machine).glob("wire-*.log"):
            starts += sum(request.node == NODE and request.writes(START) for request in WireLog(str(log)).requests())
        test.assertEqual(starts, self.done, f"{self.name}: starts on the wire")


class Traffic:
    """A reader of each machine at each entrance, a mover of each machine."""

    def __init__(self, cell, seed=1):
        self.movers = [Mover(cell, machine, seed + number).make_ready() for number, machine in enumerate(cell.machines)]
        self.readers = [Reader(cell, entrance, machine) for entrance in cell.machines for machine in cell.machines]
        for thread in (*self.movers, *self.readers):
            thread.start()

    def end(self):
        for thread in (*self.movers, *self.readers):
            thread.ending.set()
        for thread in (*self.movers, *self.readers):
            thread.end()

    def judge(self, test, readers=True):
        self.end()
        for mover in self.movers:
            mover.judge(test)
        for reader in self.readers if readers else ():
            test.assertEqual(reader.failures, [], reader.name)
            test.assertGreater(reader.answers, 0, reader.name)

    def figures(self):
        moved, asked = sum(m.done for m in self.movers), sum(m.asked for m in self.movers)
        return (f"{moved} moves by {asked} requests, {sum(m.repeated for m in self.movers)} of them repeated on purpose; "
                f"{sum(r.answers for r in self.readers)} reads")
