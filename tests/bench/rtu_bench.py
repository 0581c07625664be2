"""An RS-485 line of 16 drives that is asked as fast as it allows: axisd, a tight loop on libmodbus and python3-pymodbus
in turns, at the same simulated drives. README.md says what is measured.

    rtu_bench.py BUILD [--rounds N] [--seconds S] [--nodes N] [--baud BAUD ...]
"""
import argparse
import contextlib
import itertools
import os
import pathlib
import statistics
import sys
import tempfile
import time

from figures import cpu_seconds, percentile, running, spread, table
from rtu_cell import Cell, Line, silence

STATUS = "030003000A"  # FC03, registers 0x0003..0x000C: what all three ask, and axisd's reading of an axis
FULL_SPEED = "1 ms"  # a refresh period that no line of 16 can keep: it is never idle
SETTLE = 1.0  # s


class Loops:
    """The yardsticks. Each is a context in which the drives are asked; the value is the process's id."""

    def __init__(self, build, line):
        self.build, self.line = build, line

    @contextlib.contextmanager
    def _run(self, *command):
        with running(*command, self.line.port, str(self.line.baud), str(self.line.nodes)) as process:
            yield process.pid

    def libmodbus(self):
        return self._run(f"{self.build}/tests/bench_modbus_loop")

    def pymodbus(self):
        return self._run(sys.executable, "-B", pathlib.Path(__file__).with_name("pymodbus_loop.py"))


def watch(program, lines, seconds):
    """Lets `program` run: its CPU time in s, and what went over each line meanwhile."""
    with program() as pid:
        time.sleep(SETTLE)
        begin, cpu = time.monotonic(), cpu_seconds(pid)
        time.sleep(seconds)
        end, cpu = time.monotonic(), cpu_seconds(pid) - cpu
    return cpu, [line.frames(begin, end) for line in lines]


def is_status(frame):
    return frame[2:12] == STATUS


def excesses(line, frames):
    """How much longer than ideal each status read took that another followed, in us."""
    found = []
    for (begin, asked, frame), (_, answered, _), (following, asked_again, _) in zip(frames, frames[1:], frames[2:]):
        if asked and is_status(frame) and not answered and asked_again:
            found.append((following - begin - line.ideal()) * 1e6)
    return found


def violations(line, frames):
    """Requests that came before the line had been silent for long enough."""
    return sum(not asked_first and asked and following - begin - line.wire(len(frame) // 2) < silence(line.baud)
               for (begin, asked_first, frame), (following, asked, _) in itertools.pairwise(frames))


def measure(program, line, seconds):
    cpu, (frames,) = watch(program, [line], seconds)
    excess = excesses(line, frames)
    requests = sum(asked for _, asked, _ in frames)
    if len(excess) < 10:
        sys.exit(f"rtu_bench.py: {len(excess)} readings in {seconds} s: the drives do not answer")
    median, ideal = statistics.median(excess), line.ideal() * 1e6
    return {"excess": median, "p99": percentile(excess, 0.99), "efficiency": ideal / (ideal + median),
            "per second": requests / seconds, "status": len(excess) / requests * 100, "cpu": cpu / requests * 1e6,
            "violations": violations(line, frames)}


def report(title, found):
    print(f"\n{title}; min / median / max of the rounds")
    bare = found["libmodbus"]
    table([["", "excess, us", "99 %", "efficiency", "transactions/s", "ratio", "CPU/transaction, us", "ratio",
            "t3.5 violated"]] + [
        [name, spread([each["excess"] for each in rounds]), spread([each["p99"] for each in rounds]),
         spread([each["efficiency"] for each in rounds], 4), spread([each["per second"] for each in rounds], 1),
         spread([each["per second"] / one["per second"] for each, one in zip(rounds, bare)], 2),
         spread([each["cpu"] for each in rounds]),
         spread([each["cpu"] / one["cpu"] for each, one in zip(rounds, bare)], 2),
         str(sum(each["violations"] for each in rounds))] for name, rounds in found.items()])


def compare(build, given, baud):
    with tempfile.TemporaryDirectory() as directory, Line(build, directory, baud, given.nodes).open() as line:
        loops = Loops(build, line)
        turns = {"axisd": Cell(build, [line], FULL_SPEED).online, "libmodbus": loops.libmodbus,
                 "pymodbus": loops.pymodbus}
        found = {name: [] for name in turns}
        for _ in range(given.rounds):
            for name, program in turns.items():
                found[name].append(measure(program, line, given.seconds))
    ideal = line.ideal() * 1e3
    report(f"{given.nodes} drives at {baud} bit/s, status reads of ideally {ideal:.2f} ms", found)


def rates(line, frames, seconds):
    """Readings per second of each node that answers."""
    count = {node: 0 for node in range(1, line.nodes + 1) if node not in line.silent}
    for _, asked, frame in frames:
        if asked and is_status(frame) and int(frame[:2], 16) in count:
            count[int(frame[:2], 16)] += 1
    return [each / seconds for each in count.values()]


def compare_silent(build, given):
    """What nodes that do not answer cost the others, against the same line without them being asked for."""
    found = {}
    for _ in range(given.rounds):
        for dead in (0, 1, 3):
            with tempfile.TemporaryDirectory() as directory, \
                    Line(build, directory, 115200, given.nodes, range(2, 2 + dead)).open() as line:
                _, (frames,) = watch(Cell(build, [line], FULL_SPEED).online, [line], given.seconds)
                found.setdefault(dead, []).append(sum(rates(line, frames, given.seconds)))
    print(f"\n{given.nodes} drives at 115200 bit/s, of which some are silent: readings per second of the others in all")
    table([["silent", "readings/s", "ratio"]] + [
        [str(dead), spread(each, 1), spread([one / whole for one, whole in zip(each, found[0])], 3)]
        for dead, each in found.items()])


def four_lines(build, given):
    shares = []
    for _ in range(given.rounds):
        with tempfile.TemporaryDirectory() as directory, contextlib.ExitStack() as stack:
            lines = [stack.enter_context(Line(build, directory, 115200, given.nodes, name=f"line-{index}").open())
                     for index in range(4)]
            cpu, seen = watch(Cell(build, lines, FULL_SPEED).online, lines, given.seconds)
            requests = sum(asked for frames in seen for _, asked, _ in frames)
            shares.append((cpu / given.seconds * 100, requests / given.seconds))
    print(f"\n4 lines x {given.nodes} drives at 115200 bit/s, all asked as fast as they allow")
    table([["", "CPU, % of a core", "transactions/s"],
           ["axisd", spread([cpu for cpu, _ in shares], 1), spread([rate for _, rate in shares], 1)]])


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build")
    parser.add_argument("--rounds", type=int, default=4)
    parser.add_argument("--seconds", type=float, default=8, help="of each measurement")
    parser.add_argument("--nodes", type=int, default=16, help="4 to 127")
    parser.add_argument("--baud", type=int, nargs="*", default=[115200, 19200, 256000])
    given = parser.parse_args()
    build = os.path.abspath(given.build)
    for baud in given.baud:
        compare(build, given, baud)
    compare_silent(build, given)
    four_lines(build, given)


if __name__ == "__main__":
    main()
