"""An RS-485 line of 16 drives that is asked as fast as it allows: axisd, a tight loop on libmodbus and python3-pymodbus
in turns, at the same simulated drives; axisd and the loop at the same time, each on a line of its own; stops on such a
line, silent nodes, four lines. One table, with what is asked of each figure. README.md says what is measured.

    rtu_bench.py BUILD [--turns N] [--rounds N] [--seconds S] [--nodes N] [--baud BAUD ...] [--stops N]
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

import rtu_stops
from figures import cpu_seconds, percentile, running, spread, table
from rtu_cell import Cell, Line, silence

STATUS = "030003000A"  # FC03, registers 0x0003..0x000C: what all three ask, and axisd's reading of an axis
FULL_SPEED = "1 ms"  # a refresh period that no line of 16 can keep: it is never idle
SETTLE = 1.0  # s
TURN = 2.0  # s: short, and many of them, for what a virtual machine costs changes within minutes


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


def look_at(pids, seconds):
    """Begin, end, and the CPU time in s that each process took in between."""
    begin, before = time.monotonic(), [cpu_seconds(pid) for pid in pids]
    time.sleep(seconds)
    return begin, time.monotonic(), [cpu_seconds(pid) - cpu for pid, cpu in zip(pids, before)]


def watch(program, lines, seconds):
    """Lets `program` run: its CPU time in s, and what went over each line meanwhile."""
    with program() as pid:
        time.sleep(SETTLE)
        begin, end, (cpu,) = look_at([pid], seconds)
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


class Table:
    """Rows of figures: minimum, median and maximum of the rounds."""

    def __init__(self):
        self.rows = [["", "axisd", "libmodbus", "pymodbus", "asked", "met"]]

    def add(self, what, found, digits=0, asked="", met=None):
        """`found`: the figures of each round, by program. `met` judges the medians."""
        medians = [statistics.median(rounds) for rounds in found.values()]
        verdict = "" if met is None else "yes" if met(*medians) else "NO"
        cells = [spread(found[name], digits) if name in found else "" for name in self.rows[0][1:4]]
        self.rows.append([what, *cells, asked, verdict])

    def say(self, what, figure, asked="", met=None):
        self.rows.append([what, figure, "", "", asked, "" if met is None else "yes" if met else "NO"])


def figures_of(line, frames, cpu, seconds):
    excess = excesses(line, frames)
    requests = sum(asked for _, asked, _ in frames)
    if len(excess) < 10:
        sys.exit(f"rtu_bench.py: {len(excess)} readings in {seconds} s: the drives do not answer")
    median, ideal = statistics.median(excess), line.ideal() * 1e6
    return {"excess": median, "p99": percentile(excess, 0.99), "efficiency": ideal / (ideal + median),
            "rate": requests / seconds, "cpu": cpu / requests * 1e6, "violations": violations(line, frames)}


def measure(program, line, seconds):
    cpu, (frames,) = watch(program, [line], seconds)
    return figures_of(line, frames, cpu, seconds)


def in_turns(build, given, baud, untimed=False):
    """The figures of each round, by what and by program."""
    with tempfile.TemporaryDirectory() as directory, \
            Line(build, directory, baud, given.nodes, untimed=untimed).open() as line:
        loops = Loops(build, line)
        programs = {"axisd": Cell(build, [line], FULL_SPEED).online, "libmodbus": loops.libmodbus,
                    "pymodbus": loops.pymodbus}
        found = {}
        for turn in range(given.turns):
            names = ["axisd", "libmodbus"] if turn % 2 == 0 else ["libmodbus", "axisd"]
            for name in names + ["pymodbus"] * (turn % 3 == 0):
                for what, figure in measure(programs[name], line, TURN).items():
                    found.setdefault(what, {}).setdefault(name, []).append(figure)
    return {what: {name: figures[name] for name in programs} for what, figures in found.items()}


def side_by_side(build, given, baud):
    """As in_turns(), of axisd and libmodbus at the same time: whatever the computer does, it does to both."""
    with tempfile.TemporaryDirectory() as directory, contextlib.ExitStack() as stack:
        lines = {name: stack.enter_context(Line(build, directory, baud, given.nodes, name=name).open())
                 for name in ("axisd", "libmodbus")}
        pids = [stack.enter_context(Cell(build, [lines["axisd"]], FULL_SPEED).online()),
                stack.enter_context(Loops(build, lines["libmodbus"]).libmodbus())]
        time.sleep(SETTLE)
        slices = [look_at(pids, TURN) for _ in range(given.turns)]
        found = {}
        for begin, end, cpu in slices:
            for (name, line), used in zip(lines.items(), cpu):
                for what, figure in figures_of(line, line.frames(begin, end), used, TURN).items():
                    found.setdefault(what, {}).setdefault(name, []).append(figure)
    return found


def ratios(found):
    return {"axisd": [one / bare for one, bare in zip(found["axisd"], found["libmodbus"])]}


def compare(build, given, baud, rows):
    found, title = in_turns(build, given, baud), f"{baud} bit/s: "
    rows.add(title + "excess of a reading, us, median", found["excess"], 0, "<= libmodbus",
             lambda axisd, bare, _: axisd <= bare)
    rows.add(title + "99 %", found["p99"])
    rows.add(title + "efficiency", found["efficiency"], 4, ">= libmodbus - 0.002",
             lambda axisd, bare, _: axisd >= bare - 0.002)
    rows.add(title + "transactions/s", found["rate"], 1)
    rows.add(title + "CPU per transaction, us", found["cpu"])
    rows.add(title + "CPU, of libmodbus's", ratios(found["cpu"]), 2, "<= 1.25", lambda ratio: ratio <= 1.25)
    rows.add(title + "t3.5 violated", found["violations"], 0, "0",
             lambda axisd, *_: max(found["violations"]["axisd"]) == axisd == 0)


def compare_side_by_side(build, given, baud, rows):
    found, title = side_by_side(build, given, baud), f"{baud} bit/s, at the same time: "
    rows.add(title + "excess of a reading, us, median", found["excess"], 0, "<= libmodbus",
             lambda axisd, bare: axisd <= bare)
    rows.add(title + "CPU per transaction, us", found["cpu"])
    rows.add(title + "CPU, of libmodbus's", ratios(found["cpu"]), 2, "<= 1.25", lambda ratio: ratio <= 1.25)


def compare_untimed(build, given, rows):
    found = in_turns(build, given, 115200, untimed=True)
    rows.add("untimed: transactions/s", found["rate"])
    rows.add("untimed: of libmodbus's", ratios(found["rate"]), 3, ">= 0.8", lambda ratio: ratio >= 0.8)
    rows.add("untimed: CPU per transaction, us", found["cpu"])


def rates(line, frames, seconds):
    """Readings per second of each node that answers."""
    count = {node: 0 for node in range(1, line.nodes + 1) if node not in line.silent}
    for _, asked, frame in frames:
        if asked and is_status(frame) and int(frame[:2], 16) in count:
            count[int(frame[:2], 16)] += 1
    return [each / seconds for each in count.values()]


def compare_silent(build, given, rows):
    """What nodes that do not answer cost the others, against the same line without them being asked for."""
    found = {}
    for _ in range(given.rounds):
        for dead in (0, 1, 3):
            with tempfile.TemporaryDirectory() as directory, \
                    Line(build, directory, 115200, given.nodes, range(2, 2 + dead)).open() as line:
                _, (frames,) = watch(Cell(build, [line], FULL_SPEED).online, [line], given.seconds)
                found.setdefault(dead, []).append(sum(rates(line, frames, given.seconds)))
    rows.add("115200 bit/s: readings/s, all answer", {"axisd": found[0]}, 1)
    for dead, name, bar in ((1, "one", 0.95), (3, "three", 0.9)):
        shares = [one / whole for one, whole in zip(found[dead], found[0])]
        rows.add(f"of that with {name} silent", {"axisd": shares}, 3, f">= {bar}", lambda share, bar=bar: share >= bar)


def four_lines(build, given, rows):
    cpu, rate = [], []
    for _ in range(given.rounds):
        with tempfile.TemporaryDirectory() as directory, contextlib.ExitStack() as stack:
            lines = [stack.enter_context(Line(build, directory, 115200, given.nodes, name=f"line-{index}").open())
                     for index in range(4)]
            used, seen = watch(Cell(build, lines, FULL_SPEED).online, lines, given.seconds)
            cpu.append(used / given.seconds * 100)
            rate.append(sum(asked for frames in seen for _, asked, _ in frames) / given.seconds)
    rows.add(f"4 lines x {given.nodes} drives, 115200 bit/s: transactions/s", {"axisd": rate}, 1)
    rows.add("their CPU, % of a core", {"axisd": cpu}, 1, "<= 10", lambda share: share <= 10)


def stops(build, given, rows):
    for silent in (0, 1):
        found = rtu_stops.measure(build, given.nodes, silent, given.stops)
        title = f"stop, 115200 bit/s, {'one' if silent else 'none'} silent: "
        excess, from_call = ([get(stop) * 1e6 for stop in found.stops]
                             for get in (lambda stop: stop.excess, lambda stop: stop.from_call))
        for name, share, bar in (("p50", 0.5, 200), ("p99", 0.99, 1000), ("p99.9", 0.999, None), ("maximum", 1, None)):
            figure = percentile(excess, share)
            rows.say(f"{title}{name}, us", f"{figure:.0f}", f"<= {bar}" if bar else "", figure <= bar if bar else None)
        for name, share in (("p50", 0.5), ("p99", 0.99)):
            rows.say(f"{title}{name} from the client's call, us", f"{percentile(from_call, share):.0f}")
        bound, asked = found.bound * 1e3, f"<= {found.bound * 1e3:.1f} (published)"
        longest = max(stop.whole for stop in found.stops) * 1e3
        rows.say(f"{title}longest to its last byte, ms", f"{longest:.1f}", asked, longest <= bound)
        longest = max(stop.less_stall() for stop in found.stops) * 1e3
        rows.say(f"{title}less what bare threads were held back beyond host_allowance", f"{longest:.1f}", asked,
                 longest <= bound)
        rows.say(f"{title}longest that a bare thread was held back during a stop, ms",
                 f"{max(0.0, *(stop.stall for stop in found.stops)) * 1e3:.1f}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build")
    parser.add_argument("--turns", type=int, default=15, help="of axisd and libmodbus at the same line")
    parser.add_argument("--rounds", type=int, default=7, help="of the other measurements")
    parser.add_argument("--seconds", type=float, default=3, help="of each of those")
    parser.add_argument("--nodes", type=int, default=16, help="4 to 127")
    parser.add_argument("--baud", type=int, nargs="*", default=[115200, 19200])
    parser.add_argument("--stops", type=int, default=1000, help="of each kind")
    given = parser.parse_args()
    build, rows = os.path.abspath(given.build), Table()
    for baud in given.baud:
        compare(build, given, baud, rows)
        compare_side_by_side(build, given, baud, rows)
    compare_untimed(build, given, rows)
    four_lines(build, given, rows)
    stops(build, given, rows)
    compare_silent(build, given, rows)
    print(f"\nRS-485 lines of {given.nodes} drives, asked as fast as they allow; min / median / max of the rounds")
    table(rows.rows)


if __name__ == "__main__":
    main()
