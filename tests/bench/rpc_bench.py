"""axisd's API with 64 axes on four RS-485 lines, in turns with a bare gRPC server that sends the same messages.
README.md says what is measured.

    rpc_bench.py BUILD [--rounds N] [--seconds S]
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

from figures import cpu_seconds, lateness, percentile, running, spread, table
from rtu_cell import SERVER, Cell, Client, Line

BARE = "127.0.0.1:7446"  # 7445 is the stop lane of SERVER
PERIOD = 0.010  # s, of WatchAxes


def used(pid, act):
    """What `act` gives, and the CPU time in s that the process used meanwhile and in as long without it."""
    begin, cpu = time.monotonic(), cpu_seconds(pid)
    found = act()
    took, cpu = time.monotonic() - begin, cpu_seconds(pid) - cpu
    base = cpu_seconds(pid)
    time.sleep(took)
    return found, cpu, cpu_seconds(pid) - base


def get(client, pid, seconds):
    took, cpu, base = used(pid, lambda: [int(each) / 1e3 for each, in client.run("get", seconds)])
    return {"p50": statistics.median(took), "p99": percentile(took, 0.99), "cpu": (cpu - base) / len(took) * 1e6}


def watch(client, pid, streams, seconds):
    lines, cpu, base = used(pid, lambda: client.run("watch", streams, seconds))
    came = {}
    for stream, at in lines:
        came.setdefault(stream, []).append(int(at) / 1e9)
    if len(came) != streams:
        sys.exit(f"rpc_bench.py: {len(came)} of {streams} streams got something")
    late = [each * 1e6 for stamps in came.values() for each in lateness(stamps[1:], PERIOD)]
    return {"batches": len(lines) / streams / seconds, "p99": percentile(late, 0.99),
            "cpu": (cpu - base) / len(lines) * 1e6}


def compare_get(turns, given):
    found = {name: [] for name in turns}
    for _ in range(given.rounds):
        for name, (client, pid) in turns.items():
            found[name].append(get(client, pid, given.seconds))
    print("\nGetAxis, one call after the other; CPU of the server, beyond what it uses without; min / median / max")
    rows = [["", "p50, us", "ratio", "99 %, us", "CPU/call, us", "ratio"]]
    table(rows + [[name, spread([each["p50"] for each in rounds]), ratios(rounds, found["bare"], "p50"),
                   spread([each["p99"] for each in rounds]), spread([each["cpu"] for each in rounds]),
                   ratios(rounds, found["bare"], "cpu")] for name, rounds in found.items()])


def ratios(rounds, yardstick, what):
    return spread([each[what] / one[what] for each, one in zip(rounds, yardstick)], 2)


def compare_watch(turns, given):
    print("\nWatchAxes of 64 axes each 10 ms; CPU of the server per batch and stream, beyond what it uses without")
    rows = [["streams", "", "batches/s and stream", "late 99 %, us", "ratio", "CPU/batch, us", "ratio"]]
    for streams in (1, 10, 50):
        found = {name: [] for name in turns}
        for _ in range(given.rounds):
            for name, (client, pid) in turns.items():
                found[name].append(watch(client, pid, streams, given.seconds))
        rows += [[str(streams), name, spread([each["batches"] for each in rounds], 1),
                  spread([each["p99"] for each in rounds]), ratios(rounds, found["bare"], "p99"),
                  spread([each["cpu"] for each in rounds], 1), ratios(rounds, found["bare"], "cpu")]
                 for name, rounds in found.items()]
    table(rows)


def overload(client, given):
    """Readers that read nothing, beside GetAxis and Stop."""
    calls, stops = [], []
    for _ in range(given.rounds):
        with client.start("stall", 50, given.seconds + 20) as stalled:
            time.sleep(1)
            calls += [int(each) / 1e6 for each, in client.run("get", given.seconds)]
            stops += [(int(answered) - int(called)) / 1e6 for called, _, answered, _ in client.run("stop", 64)]
            stalled.terminate()
    print("\nbeside 50 streams that nobody reads, ms")
    table([["", "p50", "99 %"]] + [[name, f"{statistics.median(each):.2f}", f"{percentile(each, 0.99):.2f}"]
                                   for name, each in (("GetAxis", calls), ("Stop", stops))])


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
        axisd = stack.enter_context(Cell(build, lines, "200 ms").online())
        states = pathlib.Path(directory) / "states"
        client = Client(build, SERVER)
        client.run("fetch", states)
        bare = stack.enter_context(running(f"{build}/tests/bench_bare_server", BARE, states, stdout=subprocess.PIPE))
        bare.stdout.readline()
        turns = {"axisd": (client, axisd), "bare": (Client(build, BARE), bare.pid)}
        compare_get(turns, given)
        compare_watch(turns, given)
        overload(client, given)


if __name__ == "__main__":
    main()
