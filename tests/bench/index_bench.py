"""Axes of one RS-485 line that index at once: short moves to and fro, each as soon as the last one is done. axisd with a
lean client, also where its configuration permits starts in one frame; a loop on libmodbus that writes block and trigger
apart or in one frame, and python3-pymodbus, in turns at the same simulated drives. README.md says what is measured. Ends with
1 where a command expired, where 1 % of the starts came later than axisd publishes, or where a bar at the end is not met.

    index_bench.py BUILD [--axes N|N/DRIVES ...] [--baud BAUD ...] [--lines LINES/AXES ...] [--rounds N] [--seconds S] [--wire]
                   [--threads] [--report-only]
"""
import argparse
import contextlib
import dataclasses
import mmap
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import index_plot
import index_wire
from figures import by_thread, go_first, running, spread, table
from rtu_cell import SERVER, Cell, Line

HERE, THERE, PULSES = 0.1, 0.2, 2000  # mm, and the pulses of one as the drives of Cell count
SETTLE = 1.0  # s
BYTES = 100  # more than a move takes on the wire
PROGRAMS = {"axisd": "axisd", "axisd-one": "axisd, one frame", "apart": "libmodbus, apart", "one": "libmodbus, one frame",
            "pymodbus": "pymodbus"}
YARDSTICKS = {"axisd": "apart", "axisd-one": "one"}  # what each is held against
LEAST_RATIO = {"axisd": 0.90, "axisd-one": 0.85}
MOST_CPU = 0.6  # ms of axisd's CPU time a move
LEAST_GROWTH, MOST_CORE = 0.90, 40  # of the rate of so many lines, each beside one alone; % of a core that four lines take


@dataclasses.dataclass(frozen=True)
class Case:
    axes: int  # that index
    drives: int  # on the line; axisd refreshes the others, the loops leave them alone

    @staticmethod
    def of(text):
        axes, _, drives = text.partition("/")
        return Case(int(axes), int(drives or axes))

    def __str__(self):
        return str(self.axes) if self.axes == self.drives else f"{self.axes} of {self.drives}"


class Counted:
    """How often a program has the disk confirm something (`what`: sync), or allocates memory (allocation)."""

    def __init__(self, build, path, what):
        path.write_bytes(bytes(8))
        library = f"{build}/tests/libbench_{what}_counter.so"
        self.environment = {**os.environ, "LD_PRELOAD": library, "AXISD_COUNT": str(path)}
        with path.open("r+b") as file:
            self.shared = mmap.mmap(file.fileno(), 8)

    def count(self):
        return int.from_bytes(self.shared[:8], sys.byteorder)


def look(lines, case, pid, seconds, counted=None):
    """What was done in `seconds`: the rate is that of all lines, the rest that of the first; and its requests."""
    begin, before, count = time.monotonic(), by_thread(pid), counted.count() if counted else 0
    time.sleep(seconds)
    end, after, count = time.monotonic(), by_thread(pid), counted.count() - count if counted else 0
    threads = {name: (cpu - before[name][0], woken - before[name][1]) for name, (cpu, woken) in after.items()}
    cpu, woken = map(sum, zip(*threads.values()))
    requests = [index_wire.requests_of(line, line.frames(begin, end)) for line in lines]
    found = [index_wire.figures_of(each, end - begin, case.axes) for each in requests]
    rate = sum(each["rate"] for each in found)
    moves = max(sum(each["moves"] for each in found), 1)
    return found[0] | {"rate": rate, "cpu": cpu / moves * 1e3, "core": cpu / (end - begin) * 100,
                       "wakes": woken / moves, "counted": count / moves,
                       "threads": {name: (ran / moves * 1e3, slept / moves) for name, (ran, slept) in threads.items()}
                       }, requests[0]


def lap(line, case):
    """Until each axis has moved once, in s."""
    return case.axes * line.wire(BYTES)


def published(cell, case):
    """From a start that is asked for to its frame where as many axes start at once, in ms; 0: nothing is published."""
    load = cell.ask("budget")["budgets"][0]["load"]
    start = next(row for row in load if int(row.get("moving", 0)) == case.axes).get("start", "0s")
    return float(start.rstrip("s")) * 1e3


def client_figures(text):
    """What bench_index_client prints."""
    words = {name: list(map(float, values)) for name, *values in (entry.split() for entry in text.splitlines())}
    found = dict(zip(("done", "expired", "refused", "otherwise"), words["moves"]))
    for what in ("call", "start"):
        found |= dict(zip((f"{what} median", f"{what} p99", f"{what} longest"), words[what]))
    return found


def with_axisd(build, lines, case, seconds, drive="", count="sync"):
    """`case`: of each line; `drive`: keys of each axis's drive; `count`: as of Counted."""
    line = lines[0]
    counted = Counted(build, line.directory / "count", count)
    cell = Cell(build, lines, None, drive=drive)
    with cell.online(env=counted.environment) as pid:
        subprocess.run([f"{build}/tests/bench_command_client", SERVER, "ready"], check=True)
        settle, seconds = SETTLE + lap(line, case), seconds + 2 * lap(line, case)
        words = [SERVER, str(case.axes * len(lines)), str(HERE), str(THERE), str(settle + seconds + SETTLE)]
        with subprocess.Popen([f"{build}/tests/bench_index_client", *words], stdout=subprocess.PIPE, text=True) as client:
            time.sleep(settle)
            found, requests = look(lines, case, pid, seconds, counted)
            printed = client.communicate()[0]
        if client.returncode != 0:
            sys.exit(f"index_bench.py: bench_index_client ended with {client.returncode}")
        return found | client_figures(printed) | {"bound": published(cell, case)}, requests


def with_loop(build, name, line, case, seconds, profile):
    common = [line.port, str(line.baud), str(case.axes)]
    program = ([sys.executable, "-B", pathlib.Path(__file__).with_name("index_pymodbus.py"), *common] if name == "pymodbus"
               else [f"{build}/tests/bench_index_loop", *common, name])
    with running(*program, *map(str, (*profile, round(HERE * PULSES), round(THERE * PULSES)))) as process:
        time.sleep(SETTLE + lap(line, case))
        return look([line], case, process.pid, seconds + 2 * lap(line, case))


def measure(build, given, baud, case):
    """program -> what -> the figures of the rounds. axisd comes first: it configures the drives, and the loops move by what
    it writes."""
    found, profile = {name: {} for name in PROGRAMS}, None
    with tempfile.TemporaryDirectory() as directory, Line(build, directory, baud, case.drives).open() as line:
        for number in range(given.rounds):
            for name in PROGRAMS:
                if name == "axisd-one":
                    figures, requests = with_axisd(build, [line], case, given.seconds, "start_in_one_frame: true")
                elif name == "axisd":
                    figures, requests = with_axisd(build, [line], case, given.seconds)
                    profile = index_wire.profile_of(requests) or profile
                    if profile is None:
                        sys.exit("index_bench.py: axisd started nothing")
                else:
                    figures, requests = with_loop(build, name, line, case, given.seconds, profile)
                for what, figure in figures.items():
                    found[name].setdefault(what, []).append(figure)
                if given.wire and number == 0:
                    index_wire.print_move(f"{baud} bit/s, {case}, {PROGRAMS[name]}", requests, node=1)
            print(".", end="", file=sys.stderr, flush=True)
        # In a turn of its own, as counting takes time.
        counts, _ = with_axisd(build, [line], case, given.seconds, count="allocation")
        found["axisd"]["allocations"] = [counts["counted"]]
    return found


def measure_lines(build, given, baud, count, axes):
    """What -> the figures of the rounds of one line, and those of `count` at once; of axisd alone."""
    found, case = {1: {}, count: {}}, Case(axes, axes)
    with tempfile.TemporaryDirectory() as directory, contextlib.ExitStack() as stack:
        lines = [stack.enter_context(Line(build, directory, baud, axes, name=f"line-{index}").open()) for index in range(count)]
        for _ in range(given.rounds):
            for together, figures in found.items():
                for what, figure in with_axisd(build, lines[:together], case, given.seconds)[0].items():
                    figures.setdefault(what, []).append(figure)
            print(".", end="", file=sys.stderr, flush=True)
    return found


def print_lines(build, given):
    """True: nothing expired, and the bars are met."""
    rows = [["baud", "lines", "axes on each", "moves/s, all lines", "of one line's", "CPU, % of a core", "CPU a move, ms",
             "expired", "met"]]
    for baud in given.baud:
        for count, axes in given.lines:
            found = measure_lines(build, given, baud, count, axes)
            for together, figures in found.items():
                growth = [mine / its for mine, its in zip(figures["rate"], found[1]["rate"])]
                met = (sum(figures["expired"]) == 0 and statistics.median(growth) >= LEAST_GROWTH * together
                       and statistics.median(figures["core"]) <= MOST_CORE * together / 4)
                rows.append([str(baud), str(together), str(axes), spread(figures["rate"], 1), spread(growth, 2),
                             spread(figures["core"], 1), median(figures, "cpu", 2), f"{sum(figures['expired']):.0f}",
                             "yes" if met else "NO"])
    if given.lines:
        print("\nseveral lines at once, all axes index; min / median / max of the rounds, else medians")
        table(rows)
    return all(row[-1] != "NO" for row in rows)


def lines_of(text):
    count, axes = map(int, text.split("/"))
    if count < 2:
        raise argparse.ArgumentTypeError("LINES is 2 or more: one line is measured beside them anyway")
    return count, axes


def median(figures, what, digits=1):
    return f"{statistics.median(figures[what]):.{digits}f}"


def ratios(found, name):
    """Of the rates of each round."""
    return [mine / its for mine, its in zip(found[name]["rate"], found[YARDSTICKS[name]]["rate"])]


def print_rates(baud, cases):
    kinds = ("state", "canary", "block", "trigger", "one", "other", "resting")
    rows = [["axes", "", "moves/s", "its yardstick", "transactions a move", *kinds, "line used, %", "CPU a move, ms",
             "wakes a move", "allocations a move", "least share"]]
    for case, found in cases.items():
        for name, title in PROGRAMS.items():
            figures = found[name]
            all_of_them = sum(statistics.median(figures[kind]) for kind in kinds)
            beside = spread(ratios(found, name), 2) if name in YARDSTICKS else ""
            rows.append([str(case), title, spread(figures["rate"], 1), beside, f"{all_of_them:.1f}",
                         *(median(figures, kind, 2) for kind in kinds), median(figures, "used"), median(figures, "cpu", 2),
                         median(figures, "wakes"), median(figures, "allocations", 0) if "allocations" in figures else "",
                         median(figures, "share", 2)])
    print(f"\n{baud} bit/s: axes of one line that index at once; min / median / max of the rounds, else medians; `resting`: "
          "whatever was asked of other axes; `least share`: of the axis that moved least, 1 is even")
    table(rows)


def print_commands(baud, cases):
    """True: no command expired, and 99 % of the starts came within the bound."""
    rows, within = [["axes", "", "done", "expired", "refused", "otherwise", "call, ms, median", "99 %",
                     "acceptance to start, ms, median", "99 %", "longest", "published", "met", "fsyncs a move"]], True
    for case, name in ((case, name) for case in cases for name in YARDSTICKS):
        figures = cases[case][name]
        bound, late = figures["bound"][0], max(figures["start p99"])
        met = (late <= bound or bound == 0) and sum(figures["expired"]) == 0
        within = within and met
        counts = (f"{sum(figures[what]):.0f}" for what in ("done", "expired", "refused", "otherwise"))
        rows.append([str(case), PROGRAMS[name], *counts, median(figures, "call median"), median(figures, "call p99"),
                     median(figures, "start median"), f"{late:.1f}", f"{max(figures['start longest']):.1f}", f"{bound:.1f}",
                     "yes" if met else "NO", median(figures, "counted", 2)])
    print(f"\n{baud} bit/s: commands of axisd, all rounds; times of those that were done; 99 % and longest of acceptance to "
          "start are those of the worst round")
    table(rows)
    return within


def print_bars(baud, cases):
    """True: all are met, by the medians of the rounds."""
    rows = [["axes", "", "moves/s beside its yardstick", "at least", "CPU a move, ms", "of its yardstick", "at most", "met"]]
    for case, found in cases.items():
        for name, yardstick in YARDSTICKS.items():
            ratio, cpu = statistics.median(ratios(found, name)), statistics.median(found[name]["cpu"])
            met = case.axes != case.drives or (ratio >= LEAST_RATIO[name] and cpu <= MOST_CPU)
            rows.append([str(case), PROGRAMS[name], f"{ratio:.3f}", f"{LEAST_RATIO[name]:.2f}", f"{cpu:.2f}",
                         median(found[yardstick], "cpu", 2), f"{MOST_CPU:.1f}", "yes" if met else "NO"])
    print(f"\n{baud} bit/s: the bars, medians of the rounds; not judged where other axes are on the line, too")
    table(rows)
    return all(row[-1] != "NO" for row in rows)


def print_threads(baud, cases):
    rows = [["axes", "", "thread", "CPU a move, ms", "wakes a move"]]
    for case, name in ((case, name) for case in cases for name in YARDSTICKS):
        threads = cases[case][name]["threads"][-1]
        rows += [[str(case), PROGRAMS[name], thread, f"{cpu:.3f}", f"{woken:.2f}"]
                 for thread, (cpu, woken) in sorted(threads.items(), key=lambda entry: -entry[1][0]) if cpu >= 0.001]
    print(f"\n{baud} bit/s: threads of axisd, last round")
    table(rows)


def plot(path, found):
    panels = {}
    for baud, cases in found.items():
        whole = {case.axes: figures for case, figures in cases.items() if case.axes == case.drives}
        panels[f"{baud} bit/s"] = {
            title: {axes: (min(rates), statistics.median(rates), max(rates))
                    for axes, rates in ((axes, figures[name]["rate"]) for axes, figures in whole.items())}
            for name, title in PROGRAMS.items()}
    path.parent.mkdir(exist_ok=True)
    index_plot.write(path, "moves/s of the line", panels)
    print(f"\nplot: {path}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build")
    parser.add_argument("--axes", type=Case.of, nargs="*", help="that index; N/DRIVES: others are on the line, too",
                        default=list(map(Case.of, ("1", "2", "4", "8", "16", "30", "1/16", "4/16"))))
    parser.add_argument("--baud", type=int, nargs="*", default=[115200, 19200])
    parser.add_argument("--lines", type=lines_of, nargs="*", default=[(4, 16)],
                        help="LINES/AXES: so many lines at once with so many axes each, beside one of them")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=4, help="of each turn, and two laps of all axes")
    parser.add_argument("--wire", action="store_true", help="print one move of each program, frame by frame")
    parser.add_argument("--threads", action="store_true", help="print CPU time and wakes of each of axisd's threads")
    parser.add_argument("--report-only", action="store_true", help="ends with 0 whatever was seen")
    given = parser.parse_args()
    build, within = os.path.abspath(given.build), True
    go_first()
    found = {baud: {case: measure(build, given, baud, case) for case in given.axes} for baud in given.baud}
    for baud, cases in found.items():
        print_rates(baud, cases)
        within = print_commands(baud, cases) and within
        within = print_bars(baud, cases) and within
        if given.threads:
            print_threads(baud, cases)
    plot(pathlib.Path(build) / "bench" / "index.svg", found)
    within = print_lines(build, given) and within
    return 0 if within or given.report_only else 1


if __name__ == "__main__":
    sys.exit(main())
