"""What axisd costs with 1 to 480 axes: start to READY, CPU time, memory. README.md says what is measured.

    machine_bench.py BUILD [--rounds N] [--seconds S] [--axes N ...] [--scrape]
"""
import argparse
import contextlib
import os
import pathlib
import socket
import sys
import tempfile
import time
import urllib.request

from figures import cpu_seconds, spread, table
from rtu_cell import METRICS, Cell, Line

NODES = 16  # of a line
SCRAPED_BY = "axisd-metrics"  # the thread that makes the text and sends it
POLL = "200 ms"  # the default


@contextlib.contextmanager
def notify_socket(directory):
    """Where a service tells systemd that it is ready."""
    path = str(pathlib.Path(directory) / "notify")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as notified:
        notified.bind(path)
        notified.settimeout(60)
        yield path, notified


def resident_mib(pid, line="VmRSS:"):
    status = pathlib.Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    return int(next(each for each in status.splitlines() if each.startswith(line)).split()[1]) / 1024


def cpu_percent(pid, seconds, each_second):
    """Of a core, by a process and by its thread SCRAPED_BY, while `each_second` is called each second."""
    cpu, by_thread, begin = cpu_seconds(pid), cpu_seconds(pid, SCRAPED_BY), time.monotonic()
    end = begin + seconds
    while (now := time.monotonic()) < end:
        each_second()
        time.sleep(max(0, min(now + 1, end) - time.monotonic()))
    took = time.monotonic() - begin
    return (cpu_seconds(pid) - cpu) / took * 100, (cpu_seconds(pid, SCRAPED_BY) - by_thread) / took * 100


def scrape():
    """As Prometheus does. The size of the answer, in bytes."""
    asked = urllib.request.Request(f"http://{METRICS}/metrics", headers={"Accept": "application/openmetrics-text"})
    with urllib.request.urlopen(asked, timeout=10) as answer:
        return len(answer.read())


def measure(build, axes, off, seconds, scraped):
    sizes = [min(NODES, axes - first) for first in range(0, axes, NODES)]
    with tempfile.TemporaryDirectory() as directory, notify_socket(directory) as (path, notified), \
            contextlib.ExitStack() as stack:
        lines = [Line(build, directory, 115200, size, range(1, 1 + off // len(sizes)), name=f"line-{index}")
                 for index, size in enumerate(sizes)]
        for line in lines:
            stack.enter_context(line.open())
        cell = Cell(build, lines, POLL, metrics=scraped)
        begin = time.monotonic()
        with cell.run(env={**os.environ, "NOTIFY_SOCKET": path}) as process:
            while b"READY=1" not in notified.recv(4096):
                pass
            ready = time.monotonic() - begin
            cell.wait_online(process)
            online = time.monotonic() - begin
            time.sleep(2)
            found = {"ready": ready * 1e3, "online": online, "cpu": cpu_percent(process.pid, seconds, lambda: None)[0]}
            if scraped:
                whole, thread = cpu_percent(process.pid, seconds, scrape)
                found |= {"scraped": whole, "thread": thread, "page": scrape() / 1024}
            return found | {"rss": resident_mib(process.pid)}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=5, help="of each measurement")
    parser.add_argument("--scrape", action="store_true", help="measure also while the metrics are scraped each second")
    parser.add_argument("--axes", type=int, nargs="*", default=[1, 8, 30, 120, 480])
    given = parser.parse_args()
    build = os.path.abspath(given.build)
    cases = [(axes, 0) for axes in given.axes] + [(64, 8)]
    rows = [["axes", "of them off", "start to READY, ms", "to all online, s", "CPU, % of a core", "per axis",
             "memory, MiB"]]
    if given.scrape:
        rows[0] += ["CPU scraped each second", "of that thread", "page, KiB"]
    for axes, off in cases:
        found = [measure(build, axes, off, given.seconds, given.scrape) for _ in range(given.rounds)]
        rows.append([str(axes), str(off), spread([each["ready"] for each in found]),
                     spread([each["online"] for each in found], 1), spread([each["cpu"] for each in found], 1),
                     spread([each["cpu"] / axes for each in found], 3), spread([each["rss"] for each in found], 1)])
        if given.scrape:
            rows[-1] += [spread([each[key] for each in found], digits)
                         for key, digits in (("scraped", 1), ("thread", 3), ("page", 0))]
        print(".", end="", file=sys.stderr, flush=True)
    print(f"\naxes on RS-485 lines of {NODES} at 115200 bit/s, refreshed each {POLL}; min / median / max of the rounds")
    table(rows)


if __name__ == "__main__":
    main()
