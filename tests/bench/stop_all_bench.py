"""StopAll on an RS-485 line of 16 drives that is asked as fast as it allows, some of which do not answer: from its arrival
at the daemon to the last byte of the last stop frame of a drive that answers, and of the last of all, beside the bound
that axisd publishes (M15). Ends with 1 if more than the computer can be blamed for is beyond that bound.

    stop_all_bench.py BUILD [--nodes N] [--silent N ...] [--baud BAUD ...] [--stops N] [--report-only]
"""
import argparse
import bisect
import contextlib
import dataclasses
import itertools
import os
import pathlib
import random
import socket
import statistics
import subprocess
import sys
import tempfile
import time

from figures import go_first, running, table
from rtu_cell import SERVER, Cell, Line
from rtu_stops import HOST_ALLOWANCE, STOP, bare_waits, late_wakes

STOP_BYTES = 8
LATEST = 2.0  # s; no frame stays in a terminal for longer
POLL = "1 ms"  # a refresh period that no line of 16 can keep: it is never idle
#: Whether axisd knows by then that they do not answer. Who does gets its frame as if they were not there, if it does.
FRESH, KNOWN = "since just now", "for seconds"


@dataclasses.dataclass
class Stop:
    answering: float  # from its arrival to the last byte of the last frame to a drive that answers, s
    last: float  # the same of all drives, s
    late: bool  # a drive that answers seemed not to: bytes stayed in the terminal for longer than turnaround_max
    stalls: float  # how long meanwhile bare threads were held back, and bytes in the terminal, s, one after the other
    frames: list  # (s from its arrival, is a request, frame) meanwhile

    def less_stalls(self):
        """`last` without what the computer took beyond what the published bound leaves to it."""
        return self.last - max(0.0, self.stalls - HOST_ALLOWANCE)


class Hands:
    """The control socket of axisd-sim."""

    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.connect(str(path))
        self.replies = self.socket.makefile()

    def do(self, command):
        """What is answered, without its "ok"."""
        self.socket.sendall(command.encode() + b"\n")
        reply = self.replies.readline()
        if not reply.startswith("ok"):
            sys.exit(f"{sys.argv[0]}: {command}: {reply}")
        return reply[2:].strip()


def held_back(waits, begin, end):
    """Sum of the times from `begin` to `end` that belong to one of `waits`, (from, to)."""
    total, until = 0.0, begin
    for due, awake in sorted(waits):
        total += max(0.0, min(awake, end) - max(due, until))
        until = max(until, min(awake, end))
    return total


def entries_of(log):
    """(time in s, is a request, frame in hexadecimal) of each frame in a wire log of axisd."""
    found = []
    for entry in log.read_text(encoding="ascii").splitlines():
        stamp, _, direction, *words = entry.split()
        if direction in ("tx", "rx"):
            found.append((int(stamp) / 1e9, direction == "tx", "".join(word for word in words if not word.startswith("@"))))
    return found


def held_in_terminal(ours, theirs):
    """(from, to) of each frame on its way between axisd (`ours`) and the simulated drives: what a computer's kernel does with
    bytes of a pseudo terminal has no priority."""
    found, of_drives = [], {}
    for at, asked, frame in theirs:
        of_drives.setdefault((asked, frame), []).append(at)
    for at, asked, frame in ours:
        times = of_drives.get((asked, frame), [])
        index = bisect.bisect_left(times, at)
        if asked and index < len(times) and times[index] - at < LATEST:
            found.append((at, times[index]))
        if not asked and index > 0 and at - times[index - 1] < LATEST:
            found.append((times[index - 1], at))
    return found


def judge(line, ours, theirs, waits, silent, arrived):
    """The Stop that arrived at this time: the first stop frame to each drive from then on."""
    ends = {}
    for at, asked, frame in ours:
        if at >= arrived and asked and frame[2:12] == STOP:
            ends.setdefault(int(frame[:2], 16), at + line.wire(STOP_BYTES) - arrived)
    missing = set(range(1, line.nodes + 1)) - set(ends)
    if missing:
        sys.exit(f"stop_all_bench.py: no stop frame went to the drives {sorted(missing)}")
    last = max(ends.values())
    meanwhile = [entry for entry in ours if arrived <= entry[0] <= arrived + last]
    stalls = held_back(waits + held_in_terminal(meanwhile, theirs), arrived, arrived + last)
    late = any(asked and asked_again and int(frame[:2], 16) not in silent
               for (_, asked, frame), (_, asked_again, _) in itertools.pairwise(meanwhile))
    return Stop(answering=max(end for node, end in ends.items() if node not in silent), last=last, late=late, stalls=stalls,
                frames=[(at - arrived, asked, frame) for at, asked, frame in meanwhile])


def wait_online(cell, count):
    end = time.monotonic() + 120
    while time.monotonic() < end:
        axes = cell.ask("list").get("axes", [])
        if sum(axis.get("link") == "LINK_STATE_ONLINE" for axis in axes) == count:
            return
        time.sleep(0.1)
    sys.exit(f"stop_all_bench.py: not {count} axes online")


def published(cell):
    """From the arrival of a stop of all axes to its last byte, in s."""
    axes = cell.ask("budget")["budgets"][0]["axes"]
    return max(float(axis["stop_all"]["last_frame"].rstrip("s")) for axis in axes)


def measure(build, baud, given, silent_counts):
    """(how many silent, since when) -> its Stops; and the bound."""
    chance, calls = random.Random(baud), []
    with tempfile.TemporaryDirectory() as directory, Line(build, directory, baud, given.nodes).open() as line:
        cell = Cell(build, [line], POLL)
        log, waits_log = pathlib.Path(directory) / "wire.log", pathlib.Path(directory) / "waits.log"
        with cell.online("--wire-log", log), bare_waits(build, waits_log), contextlib.ExitStack() as stack:
            bound, hands = published(cell), Hands(line.hands)
            client = stack.enter_context(running(f"{build}/tests/bench_rpc_client", SERVER, "stop-all", "-",
                                                 stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True))
            for number in range(given.stops):
                for count in silent_counts:
                    silent = sorted(chance.sample(range(1, given.nodes + 1), count))
                    known = count > 0 and number % 2 == 1
                    wait_online(cell, given.nodes)
                    for node in silent:
                        hands.do(f"fault drop_request count=-1 node={node}")
                    if known:
                        wait_online(cell, given.nodes - count)
                    time.sleep(chance.uniform(0, 0.03))
                    client.stdin.write("\n")
                    client.stdin.flush()
                    _, arrived, _ = client.stdout.readline().split()
                    calls.append((count, KNOWN if known else FRESH if count else "", silent, int(arrived) / 1e9))
                    time.sleep(bound + 0.3)
                    hands.do("fault clear")
                    cell.ask("release-stop", "--all")
        ours, theirs, waits = entries_of(log), line.frames(0, time.monotonic()), late_wakes(waits_log)
    found = {}
    for count, since, silent, arrived in calls:
        found.setdefault((count, since), []).append(judge(line, ours, theirs, waits, silent, arrived))
    return found, bound


def milliseconds(values):
    """Median and maximum."""
    return f"{statistics.median(values) * 1e3:.1f} / {max(values) * 1e3:.1f}"


def tell(stop):
    """Frame by frame."""
    print(f"\nthe longest, {stop.last * 1e3:.1f} ms, of which {stop.stalls * 1e3:.1f} ms were stalls:")
    for at, asked, frame in stop.frames:
        print(f"  {at * 1e3:8.1f} ms {'to  ' if asked else 'from'} {int(frame[:2], 16):3d}: {frame}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build")
    parser.add_argument("--nodes", type=int, default=16, help="2 to 127")
    parser.add_argument("--silent", type=int, nargs="*", default=[0, 1, 4, 15])
    parser.add_argument("--baud", type=int, nargs="*", default=[115200, 9600])
    parser.add_argument("--stops", type=int, default=60, help="of each kind; every other one of drives known to be silent")
    parser.add_argument("--report-only", action="store_true", help="ends with 0 whatever was seen")
    given = parser.parse_args()
    build, within = os.path.abspath(given.build), True
    go_first()
    rows = [["bit/s", "silent", "", "stops", "last answering", "last of all", "less stalls", "published", "met"]]
    for baud in given.baud:
        found, bound = measure(build, baud, given, given.silent)
        for (count, since), all_of_them in sorted(found.items()):
            # The bound presumes that who answers does so within turnaround_max. Most have to be judged, though.
            stops = [stop for stop in all_of_them if given.report_only or not stop.late]
            if 2 * len(stops) < len(all_of_them):
                sys.exit("stop_all_bench.py: this computer is too busy: most bytes come too late for the simulated drives")
            met = max(stop.less_stalls() for stop in stops) <= bound
            within = within and met
            if not met:
                tell(max(stops, key=Stop.less_stalls))
            rows.append([str(baud), f"{count} of {given.nodes}", since, f"{len(stops)} of {len(all_of_them)}",
                         milliseconds([stop.answering for stop in stops]), milliseconds([stop.last for stop in stops]),
                         f"{max(stop.less_stalls() for stop in stops) * 1e3:.1f}", f"{bound * 1e3:.1f}",
                         "yes" if met else "NO"])
    print("\nStopAll: from its arrival to the last byte of a stop frame, ms, median / longest; less stalls: the longest without "
          "what bare threads and the bytes of the terminal were held back beyond host_allowance; stops in which the terminal kept "
          "bytes for longer than turnaround_max are not among them")
    table(rows)
    return 0 if within or given.report_only else 1


if __name__ == "__main__":
    sys.exit(main())
