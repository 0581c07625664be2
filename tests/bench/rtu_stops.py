"""Stops at random moments on a saturated line, for rtu_bench.py: how long after its arrival at the daemon (and after the
client's call) the frame begins, beyond what had to be waited for, and the longest beside the bound that axisd
publishes."""
import dataclasses
import tempfile
import time

from rtu_cell import SERVER, Cell, Client, Line, silence

STOP = "0600280000"  # FC06, register 0x0028 = 0
POLL = "1 ms"  # a refresh period that no line of 16 can keep: it is never idle
TURNAROUND_MAX = 20e-3  # s, the default: from then on a stop cuts the wait for a silent node


@dataclasses.dataclass
class Found:
    excess: list  # of each stop from its arrival, us
    from_call: list  # the same from the client's call
    longest: float  # from the call to the last byte, ms
    bound: float  # of that, ms


def requests_of(log):
    """(time at which axisd gave it to the port in s, frame in hexadecimal) of each request in a wire log."""
    found = []
    for entry in log.read_text(encoding="ascii").splitlines():
        stamp, _, direction, *words = entry.split()
        if direction == "tx":
            found.append((int(stamp) / 1e9, "".join(word for word in words if not word.startswith("@"))))
    return found


def earliest(line, given, frames, called):
    """When a request that was called for at `called` may begin: after what is under way, and the silence. Under way is
    what axisd had `given` to its port; what became of it is seen on the line."""
    began, request = max(entry for entry in given if entry[0] <= called)
    index = next(i for i, (at, asked, frame) in enumerate(frames) if asked and at >= began and frame == request)
    (begin, _, _), (at, asked_again, reply) = frames[index:index + 2]
    if asked_again:  # a node that did not answer
        free = begin + line.wire(len(request) // 2)
        return max(called, free + TURNAROUND_MAX)
    return max(called, at + line.wire(len(reply) // 2) + silence(line.baud))


def bound(cell):
    """Published: from a stop's arrival to its last byte, in ms."""
    axes = cell.ask("budget")["budgets"][0]["axes"]
    return max(float(axis["stop_alone"]["last_frame"].rstrip("s")) for axis in axes) * 1e3


def measure(build, nodes, silent, count):
    with tempfile.TemporaryDirectory() as directory, \
            Line(build, directory, 115200, nodes, range(2, 2 + silent)).open() as line:
        cell = Cell(build, [line], POLL)
        log = line.directory / "wire.log"
        with cell.online("--wire-log", log):
            begin = time.monotonic()
            calls = Client(build, SERVER).run("stop", count)
            time.sleep(0.5)  # the last was answered, its frame may be still to come
            given = [request for request in requests_of(log) if request[0] >= begin]
            frames = line.frames(begin, time.monotonic())
            found = Found([], [], 0, bound(cell))
    for called, arrived, _, axis in calls:
        called, arrived, node = int(called) / 1e9, int(arrived) / 1e9, int(axis.rsplit("-", 1)[1])
        index = next(i for i, (at, asked, frame) in enumerate(frames)
                     if asked and at > called and frame.startswith(f"{node:02X}{STOP}"))
        sent, _, frame = frames[index]
        before = frames[max(0, index - 8):index + 1]
        asked = [request for request in given if before[0][0] <= request[0] <= sent]
        found.excess.append((sent - earliest(line, asked, before, arrived)) * 1e6)
        found.from_call.append((sent - earliest(line, asked, before, called)) * 1e6)
        found.longest = max(found.longest, (sent + line.wire(len(frame) // 2) - called) * 1e3)
    return found
