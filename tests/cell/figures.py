"""Figures of a cell, for docs/cell.md; no test. By hand, on a computer that does nothing else:
    PYTHONPATH=tests/e2e AXISD=... AXISD_SIM=... AXISCTL=... AXISD_CELL=... tests/cell/run.sh /usr/bin/python3 -B tests/cell/figures.py
"""
import argparse
import statistics
import time

from harness import wait_for
from rig import Cell, CellClient, MachineWatch, cell_pb


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


def main():
    words = argparse.ArgumentParser()
    words.add_argument("--rounds", type=int, default=10)
    words.add_argument("--axes", type=int, default=8)
    chosen = words.parse_args()
    cell = Cell(axes=chosen.axes)
    try:
        bench = Bench(cell.start_all())
        bench.stop_all(chosen.rounds)
        bench.births_and_deaths(chosen.rounds)
        for watch in bench.watches.values():
            watch.close()
    finally:
        cell.close()


if __name__ == "__main__":
    main()
