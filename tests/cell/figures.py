"""Figures of a cell, for docs/cell.md; no test. By hand, on a computer that does nothing else:
    PYTHONPATH=tests/e2e AXISD=... AXISD_SIM=... AXISCTL=... AXISD_CELL=... tests/cell/run.sh /usr/bin/python3 -B tests/cell/figures.py
"""
import argparse
import os
import pathlib
import statistics
import time

from harness import axis_pb, wait_for
from rig import AXIS, Cell, CellClient, MachineWatch, cell_pb


def line(text, values, unit="s"):
    values = sorted(values)
    print(f"{text}: {len(values)} times, least {values[0]:.3f} {unit}, median {statistics.median(values):.3f} {unit}, "
          f"most {values[-1]:.3f} {unit}", flush=True)


class Bench:
    def __init__(self, cell):
        self.cell = cell
        self.clients = {name: CellClient(cell, name) for name in cell.machines}
        for client in self.clients.values():
            wait_for(lambda c=client: c.states() == dict.fromkeys(cell.machines, "PRESENT"), "all are present")
        self.watches = {name: MachineWatch(client) for name, client in self.clients.items()}

    def seen(self, machine, state, after):
        """How long until the entrances of the others saw it."""
        return [wait_for(lambda w=watch: [at for at, to in w.states(machine, after) if to == state], f"{machine} {state}")[0]
                - after for name, watch in self.watches.items() if name != machine]

    def births_and_deaths(self, rounds):
        died, born, vanished, healed = [], [], [], []
        for _ in range(rounds):
            at = time.monotonic()
            self.cell.kill("press-3", "axisd")
            died += self.seen("press-3", "SILENT", at)
            self.cell.start_axisd("press-3")
            at = time.monotonic()
            born += [max(0.0, after - 1) for after in self.seen("press-3", "PRESENT", at - 1)]
            at = time.monotonic()
            self.cell.cut("press-2")
            vanished += self.seen("press-2", "SILENT", at)
            at = time.monotonic()
            self.cell.heal("press-2")
            healed += self.seen("press-2", "PRESENT", at)
        line("death, the connection is closed", died)
        line("birth, from when the daemon was seen to take connections", born)
        line("death, the computer vanishes", vanished)
        line("back again after the cable", healed)

    def stop_all(self, rounds):
        took = []
        for number in range(rounds):
            client = self.clients[self.cell.machines[number % len(self.cell.machines)]]
            at = time.monotonic()
            client.call(client.cell.StopAll, cell_pb.StopAllRequest(reason="figures"), 10)
            took.append(1000 * (time.monotonic() - at))
            client.call(client.cell.ReleaseStopAll, cell_pb.ReleaseStopAllRequest(), 10)
        line("StopAll of all machines, answered", took, "ms")

    def forwarding(self, calls):
        """The same call, by turns: to the daemon, through its own entrance, through another one."""
        ways = {"direct": CellClient(self.cell, "press-2", port=7443), "own entrance": CellClient(self.cell, "press-2"),
                "other entrance": CellClient(self.cell, "press-1", "press-2")}
        took = {name: [] for name in ways}
        request = axis_pb.GetAxisRequest(axis=AXIS)
        for number in range(calls + 50):
            for name, client in ways.items():
                at = time.perf_counter()
                client.call(client.axis.GetAxis, request)
                if number >= 50:
                    took[name].append(1000 * (time.perf_counter() - at))
        for name, values in took.items():
            line(f"GetAxis, {name}", values, "ms")

    def watching(self, seconds):
        """What streams cost the entrance that passes them on."""
        client = CellClient(self.cell, "press-1", "press-2")
        stream = client.axis.WatchAxes(axis_pb.WatchAxesRequest(period={"nanos": 50_000_000}))
        next(stream)
        pid = self.cell.programs["press-1", "cell"].process.pid
        before, at, count = cpu(pid), time.monotonic(), 0
        for _ in stream:
            count += 1
            if time.monotonic() - at > seconds:
                break
        used = cpu(pid) - before
        stream.cancel()
        print(f"WatchAxes of {len(client.call(client.axis.ListAxes, axis_pb.ListAxesRequest()).axes)} axes, forwarded: {count / seconds:.1f} messages/s, "
              f"{100 * used / seconds:.1f} % of a core", flush=True)


def cpu(pid):
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(") ", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def main():
    words = argparse.ArgumentParser()
    words.add_argument("--rounds", type=int, default=10)
    words.add_argument("--calls", type=int, default=2000)
    words.add_argument("--axes", type=int, default=16)
    chosen = words.parse_args()
    cell = Cell(axes=chosen.axes)
    try:
        bench = Bench(cell.start_all())
        bench.forwarding(chosen.calls)
        bench.watching(10)
        bench.stop_all(chosen.rounds)
        bench.births_and_deaths(chosen.rounds)
        for watch in bench.watches.values():
            watch.close()
    finally:
        cell.close()


if __name__ == "__main__":
    main()
