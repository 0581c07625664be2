"""How many commands a second axisd takes, and how it starts with all the request ids that it remembers. README.md says
what is measured.

    admission_bench.py BUILD [--rounds N] [--seconds S] [--axes N] [--ids N]
"""
import argparse
import contextlib
import os
import pathlib
import subprocess
import sys
import tempfile
import time

from figures import cpu_seconds, spread, table
from machine_bench import NODES, notify_socket, resident_mib
from rtu_cell import SERVER, Cell, Line

TOTAL = 1 << 20  # server.limits.request_ids, its default
PERIOD_MS = 500  # each axis indexes twice a second


@contextlib.contextmanager
def ready_cell(build, axes, poll, per_line=NODES):
    """axisd on lines where bytes take no time; every axis is enabled, at 0."""
    sizes = [min(per_line, axes - first) for first in range(0, axes, per_line)]
    with tempfile.TemporaryDirectory() as directory, contextlib.ExitStack() as stack:
        lines = [stack.enter_context(Line(build, directory, 115200, size, name=f"line-{index}", untimed=True).open())
                 for index, size in enumerate(sizes)]
        with Cell(build, lines, poll, calls=1000).online() as pid:
            commands(build, "ready")
            yield pid


def commands(build, *words):
    """The numbers that bench_command_client prints."""
    done = subprocess.run([f"{build}/tests/bench_command_client", SERVER, *map(str, words)], capture_output=True,
                          text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{sys.argv[0]}: {done.stderr}")
    print(done.stderr, end="", file=sys.stderr)
    return [float(word) for word in done.stdout.split()]


def noops(build, rounds, seconds):
    rows = [["clients", "no-op moves/s", "refused", "call, us, median", "99 %", "CPU of axisd, us each"]]
    with ready_cell(build, NODES, "1 s", per_line=1) as pid:
        for clients in (1, 4, 16):
            found = []
            for _ in range(rounds):
                cpu = cpu_seconds(pid)
                done, otherwise, median, late = commands(build, "noop", clients, seconds)
                found.append((done / seconds, otherwise, median, late, (cpu_seconds(pid) - cpu) / max(done, 1) * 1e6))
            rows.append([str(clients), *(spread(column) for column in zip(*found))])
    print(f"\nmoves to where the axes stand, each on the disk before it is answered, on {NODES} lines of one axis; "
          "min / median / max of the rounds")
    table(rows)


def indexing(build, axes, seconds):
    rows = [["axes", "moves/s", "done", "otherwise", "not ended when the next was due", "move, ms, median", "99 %",
             "CPU of axisd, % of a core"]]
    with ready_cell(build, axes, "200 ms") as pid:
        cpu = cpu_seconds(pid)
        done, otherwise, late, median, slowest = commands(build, "index", PERIOD_MS, seconds)
        cpu = (cpu_seconds(pid) - cpu) / seconds * 100
        rows.append([str(axes), f"{done / seconds:.0f}", f"{done:.0f}", f"{otherwise:.0f}", f"{late:.0f}",
                     f"{median:.0f}", f"{slowest:.0f}", f"{cpu:.0f}"])
    print(f"\neach axis moves by 1 mm once in {PERIOD_MS} ms, on lines of {NODES} where bytes take no time")
    table(rows)


def start(build, directory):
    """Start to READY in ms, and memory then, in MiB."""
    with notify_socket(directory) as (path, notified):
        cell = Cell(build, [Line(build, directory, 115200, 1)], "200 ms")
        begin = time.monotonic()
        with cell.run(env={**os.environ, "NOTIFY_SOCKET": path}) as process:
            while b"READY=1" not in notified.recv(4096):
                pass
            ready = time.monotonic() - begin
            time.sleep(1)
            found = ready * 1e3, resident_mib(process.pid)
    pathlib.Path(path).unlink()
    return found


def full_journal(build, rounds, ids):
    rows = [["ids in the journal", "its size, MiB", "start to READY, ms", "memory, MiB"]]
    for count in (0, ids):
        with tempfile.TemporaryDirectory() as directory:
            state = pathlib.Path(directory) / "state"
            state.mkdir()
            if count:
                subprocess.run([f"{build}/tests/bench_full_journal", state, str(count)], check=True)
            size = sum(file.stat().st_size for file in state.iterdir()) / 2**20
            found = [start(build, directory) for _ in range(rounds)]
            rows.append([str(count), f"{size:.1f}", *(spread(column, 1) for column in zip(*found))])
    print("\none axis, switched off; min / median / max of the rounds")
    table(rows)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=int, default=5, help="of each measurement")
    parser.add_argument("--axes", type=int, default=480, help="that index")
    parser.add_argument("--ids", type=int, default=TOTAL)
    given = parser.parse_args()
    build = os.path.abspath(given.build)
    full_journal(build, given.rounds, given.ids)
    noops(build, given.rounds, given.seconds)
    indexing(build, given.axes, 4 * given.seconds)


if __name__ == "__main__":
    main()
