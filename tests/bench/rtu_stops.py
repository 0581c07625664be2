"""Stops at random moments on a saturated line, for rtu_bench.py: how long after its arrival at the daemon (and after the
client's call) the frame begins, beyond what had to be waited for, and the longest beside the bound that axisd
publishes. What the computer held back meanwhile, even from threads that do nothing but wake, is known of each."""
import bisect
import contextlib
import dataclasses
import subprocess
import tempfile
import time

from rtu_cell import SERVER, Cell, Client, Line, silence

STOP = "0600280000"  # FC06, register 0x0028 = 0
POLL = "1 ms"  # a refresh period that no line of 16 can keep: it is never idle
TURNAROUND_MAX = 20e-3  # s, the default: from then on a stop cuts the wait for a silent node
HOST_ALLOWANCE = 5e-3  # s, the default: what the published bound leaves to the computer


@dataclasses.dataclass
class Stop:
    excess: float  # from its arrival, s
    from_call: float  # the same from the client's call, s
    whole: float  # from the call to the last byte, s
    stall: float  # of that, the longest that a bare thread was held back meanwhile, s

    def less_stall(self):
        """`whole` without what the computer took beyond what the published bound leaves to it."""
        return self.whole - max(0.0, self.stall - HOST_ALLOWANCE)


@dataclasses.dataclass
class Found:
    stops: list
    bound: float  # published, s


@contextlib.contextmanager
def bare_waits(build, path):
    """Meanwhile bare threads wake each millisecond; `path` is then what bench_bare_waits prints: nothing where real-time
    priority is not permitted."""
    with path.open("w", encoding="ascii") as log, \
            subprocess.Popen([f"{build}/tests/bench_bare_waits"], stdout=log) as process:
        try:
            yield
        finally:
            process.terminate()


def late_wakes(path):
    """(due, awake) of each late wake of a bare thread, in s."""
    pairs = (line.split() for line in path.read_text(encoding="ascii").splitlines())
    return [(int(due) / 1e9, (int(due) + int(late)) / 1e9) for due, late in pairs]


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
    """Published: from a stop's arrival to its last byte, in s."""
    axes = cell.ask("budget")["budgets"][0]["axes"]
    return max(float(axis["stop_alone"]["last_frame"].rstrip("s")) for axis in axes)


def judge(line, given, frames, waits, call):
    """The Stop of one line that the client printed."""
    called, arrived, _, axis = call
    called, arrived, node = int(called) / 1e9, int(arrived) / 1e9, int(axis.rsplit("-", 1)[1])
    after = bisect.bisect_right(frames, (called,))
    index = next(i for i in range(after, len(frames))
                 if frames[i][1] and frames[i][2].startswith(f"{node:02X}{STOP}"))
    sent, _, frame = frames[index]
    before = frames[max(0, index - 8):index + 1]
    asked = given[bisect.bisect_left(given, (before[0][0],)):bisect.bisect_right(given, (sent,))]
    return Stop(excess=sent - earliest(line, asked, before, arrived),
                from_call=sent - earliest(line, asked, before, called),
                whole=sent + line.wire(len(frame) // 2) - called,
                stall=max([0.0, *(min(awake, sent) - max(due, called) for due, awake in waits)]))


def measure(build, nodes, silent, count):
    with tempfile.TemporaryDirectory() as directory, \
            Line(build, directory, 115200, nodes, range(2, 2 + silent)).open() as line:
        cell = Cell(build, [line], POLL)
        log, waits_log = line.directory / "wire.log", line.directory / "waits.log"
        with cell.online("--wire-log", log), bare_waits(build, waits_log):
            begin = time.monotonic()
            calls = Client(build, SERVER).run("stop", count)
            time.sleep(0.5)  # the last was answered, its frame may be still to come
            published = bound(cell)
        given = [request for request in requests_of(log) if request[0] >= begin]
        frames, waits = line.frames(begin, time.monotonic()), late_wakes(waits_log)
    return Found([judge(line, given, frames, waits, call) for call in calls], published)
