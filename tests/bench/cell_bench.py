"""Calls through the entrance of a cell, in turns with the same calls straight to axisd. README.md says what is measured.

    cell_bench.py BUILD [--rounds N] [--seconds S]
"""
import argparse
import contextlib
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

from figures import cpu_seconds, percentile, running, spread, table
from rtu_cell import SERVER, Cell, Client, Line

ENTRANCE = "127.0.0.1:7447"
PERIOD_MS = 50
STREAMS = (1, 10)


@contextlib.contextmanager
def entrance(build, directory):
    """An axisd-cell before SERVER, once it passes calls on."""
    path = pathlib.Path(directory) / "cell.yaml"
    path.write_text(f"cell: bench\nmachine: bench\nlisten: {ENTRANCE}\naxisd: {{ server: {SERVER} }}\n"
                    f"state: {directory}/cell-state\n", encoding="utf-8")
    with running(f"{build}/api/cell/axisd-cell", "--config", path) as process:
        asked = [f"{build}/api/axisctl/axisctl", "--server", ENTRANCE, "--json", "list"]
        end = time.monotonic() + 30
        while subprocess.run(asked, capture_output=True, check=False).returncode != 0:
            if time.monotonic() > end or process.poll() is not None:
                sys.exit("cell_bench.py: the entrance does not pass calls on")
            time.sleep(0.1)
        yield process.pid


def compare_get(turns, given):
    found = {name: [] for name in turns}
    for _ in range(given.rounds):
        for name, client in turns.items():
            took = [int(each) / 1e3 for each, in client.run("get", given.seconds)]
            found[name].append({"p50": statistics.median(took), "p99": percentile(took, 0.99)})
    print("\nGetAxis of 64 axes, one call after the other; min / median / max")
    rows = [["", "p50, us", "more than direct, us", "ratio", "99 %, us"]]
    for name, rounds in found.items():
        both = list(zip(rounds, found["direct"]))
        rows.append([name, spread([each["p50"] for each in rounds]),
                     spread([each["p50"] - direct["p50"] for each, direct in both]),
                     spread([each["p50"] / direct["p50"] for each, direct in both], 2),
                     spread([each["p99"] for each in rounds])])
    table(rows)


def idle_share(pid, seconds):
    before, begin = cpu_seconds(pid), time.monotonic()
    time.sleep(seconds)
    return (cpu_seconds(pid) - before) / (time.monotonic() - begin)


def compare_watch(client, pid, given):
    print(f"\nWatchAxes of 64 axes each {PERIOD_MS} ms, passed on; CPU time of the entrance, % of a core")
    rows = [["streams", "batches/s and stream", "CPU, %", "CPU without, %"]]
    for streams in STREAMS:
        shares, idle, rates = [], [], []
        for _ in range(given.rounds):
            idle.append(100 * idle_share(pid, given.seconds))
            before, begin = cpu_seconds(pid), time.monotonic()
            lines = client.run("watch", streams, given.seconds, PERIOD_MS)
            shares.append(100 * (cpu_seconds(pid) - before) / (time.monotonic() - begin))
            rates.append(len(lines) / streams / given.seconds)
        if min(rates) == 0:
            sys.exit("cell_bench.py: nothing was passed on")
        rows.append([str(streams), spread(rates, 1), spread(shares, 2), spread(idle, 2)])
    table(rows)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=int, default=5, help="of each measurement")
    given = parser.parse_args()
    build = os.path.abspath(given.build)
    with tempfile.TemporaryDirectory() as directory, contextlib.ExitStack() as stack:
        lines = [stack.enter_context(Line(build, directory, 115200, 16, name=f"line-{index}").open())
                 for index in range(4)]
        stack.enter_context(Cell(build, lines, "200 ms").online())
        pid = stack.enter_context(entrance(build, directory))
        turns = {"direct": Client(build, SERVER), "through an entrance": Client(build, ENTRANCE)}
        compare_get(turns, given)
        compare_watch(turns["through an entrance"], pid, given)


if __name__ == "__main__":
    main()
