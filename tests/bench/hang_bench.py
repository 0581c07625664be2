"""A daemon that hangs while its axes turn, under a supervisor that does what systemd does with deploy/axisd.service: SIGSTOP
at any moment, no more WATCHDOG=1, SIGKILL, `axisd --quiesce`, a restart. By the log of the simulated drives: from the hang
to the last byte of the last drive's first stop frame, beside the bound that `axisctl budget` prints. Ends with 1 beyond it.

    hang_bench.py BUILD [--hangs N] [--axes N] [--baud BAUD] [--report-only]
"""
import argparse
import os
import pathlib
import random
import re
import signal
import statistics
import sys
import time

from figures import percentile, table

BITS, STOP_BYTES = 10, 8


def harness(build):
    """The end-to-end tests' own, with the programs of this build."""
    os.environ.update(AXISD=f"{build}/daemon/axisd", AXISD_SIM=f"{build}/daemon/axisd-sim",
                      AXISCTL=f"{build}/api/axisctl/axisctl")
    sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "e2e"))
    import harness as tools  # needs these
    return tools


def bound_of(machine):
    """In s, as published."""
    text = machine.axisctl("budget", machine.config).stdout
    found = re.search(r"the last stop frame of all axes goes\s+out\s+within\s+([\d.]+)\s+ms", text)
    if not found:
        sys.exit(f"hang_bench.py: axisctl budget does not say it:\n{text}")
    return float(found[1]) / 1e3


def set_turning(tools, machine, axes):
    for axis in axes:
        machine.client.wait_online(axis)
        machine.client.wait_state(axis, lambda s: s.state != tools.pb.STATE_STOPPING,
                                  f"{axis} can be asked for something")
        if machine.client.state(axis).state == tools.pb.STATE_ERROR_STOP:
            machine.client.to_done("Reset", axis)
        machine.client.to_done("Enable", axis)
        machine.client.motion("MoveVelocity", axis, velocity=2.0, wait=tools.STARTED)
    for node in range(1, len(axes) + 1):
        machine.sim.wait_moving(node)


def hang(tools, machine, supervisor, axes, chance):
    """Times of one hang, in ns: (it began, the last word, the kill, quiesced, ready again)."""
    set_turning(tools, machine, axes)
    time.sleep(chance.uniform(0, 1))
    began = time.monotonic_ns()
    os.kill(machine.daemon.process.pid, signal.SIGSTOP)
    killed = supervisor.wait_for("SIGKILL", since=began)
    quiesced = supervisor.wait_for("quiesced 0", since=began)
    still = [node for node in range(1, len(axes) + 1) if machine.sim.shaft(node).moving]
    if still:
        sys.exit(f"hang_bench.py: nodes {still} turn after axisd --quiesce")
    ready = supervisor.wait_for("READY=1", since=began)
    return began, supervisor.last_word_before(killed), killed, quiesced, ready


def stop_ends(tools, machine, hangs, nodes, baud):
    """Of each hang: when the last byte of the last drive's first stop frame had gone out, ns."""
    wire = int(STOP_BYTES * BITS / baud * 1e9)
    stops = machine.sim.wire.writes(tools.STOP)
    starts = machine.sim.wire.writes(tools.START)
    ends = []
    for began, _, killed, quiesced, ready in hangs:
        first = {}
        for frame in stops:
            if killed <= frame.time <= quiesced:
                first.setdefault(frame.node, frame.time + wire)
        if len(first) != nodes or any(began <= frame.time <= ready for frame in starts):
            sys.exit(f"hang_bench.py: told to stop: {sorted(first)}; or something was started")
        ends.append(max(first.values()))
    return ends


def report(hangs, ends, bound):
    rows = [["from", "to", "median, ms", "95 %", "longest", "bound"]]

    def row(begin, end, times, limit=None):
        rows.append([begin, end, f"{statistics.median(times):.0f}", f"{percentile(times, 0.95):.0f}", f"{max(times):.0f}",
                     "" if limit is None else f"{limit * 1e3:.0f}"])
    row("last word", "kill", [(killed - word) / 1e6 for _, word, killed, _, _ in hangs])
    row("hang", "kill", [(killed - began) / 1e6 for began, _, killed, _, _ in hangs])
    row("kill", "last stop frame", [(end - each[2]) / 1e6 for each, end in zip(hangs, ends)])
    whole = [(end - each[0]) / 1e6 for each, end in zip(hangs, ends)]
    row("hang", "last stop frame", whole, bound)
    row("hang", "served again", [(ready - began) / 1e6 for began, _, _, _, ready in hangs])
    table(rows)
    return max(whole) <= bound * 1e3


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("build")
    parser.add_argument("--hangs", type=int, default=100)
    parser.add_argument("--axes", type=int, default=8)
    parser.add_argument("--baud", type=int, default=115200)
    parser.add_argument("--patience", type=int, default=1,
                        help="so many times the unit's interval, on a computer that is busy with other things")
    parser.add_argument("--report-only", action="store_true", help="ends with 0 whatever was seen")
    given = parser.parse_args()
    tools = harness(given.build)
    axes = {f"axis-{node}": tools.spinner(node) for node in range(1, given.axes + 1)}
    machine = tools.Machine(axes, baud=given.baud, turnaround="20 ms")
    chance = random.Random(41)
    try:
        machine.start_lines()
        bound = bound_of(machine)
        supervisor = tools.Supervisor(machine, patience=given.patience)
        try:
            supervisor.wait_for("READY=1")
            hangs = [hang(tools, machine, supervisor, axes, chance) for _ in range(given.hangs)]
        finally:
            supervisor.close()
        ends = stop_ends(tools, machine, hangs, given.axes, given.baud)
        print(f"{given.hangs} hangs of axisd while {given.axes} axes turn at {given.baud} bit/s")
        met = report(hangs, ends, bound)
    finally:
        machine.close()
        machine.remove()
    return 0 if met or given.report_only else 1


if __name__ == "__main__":
    sys.exit(main())
