"""Figures of a cell, for docs/cell.md; no test. By hand, on a computer that does nothing else:
    PYTHONPATH=tests/e2e AXISD=... AXISD_SIM=... AXISCTL=... AXISD_CELL=... tests/cell/run.sh /usr/bin/python3 -B tests/cell/figures.py
"""
import argparse
import pathlib
import statistics
import time

from harness import STOP, bus_pb, wait_for
from harness.wire import WireLog
from rig import Cell, CellClient, MachineWatch, cell_pb


def line(text, values, unit="s"):
    values = sorted(values)
    print(f"{text}: {len(values)} times, least {values[0]:.3f} {unit}, median {statistics.median(values):.3f} {unit}, "
          f"most {values[-1]:.3f} {unit}", flush=True)


class Bench:
    def __init__(self, cell, axes):
        self.cell, self.axes = cell, axes
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

    def stop_frames(self, rounds):
        """One machine is dead and one is frozen: the last of the first stop frames to the living one's moving axes, from the
        call, beside the bound that its axisd publishes."""
        axes = [f"spindle-{number + 1}" for number in range(self.axes)]
        direct = CellClient(self.cell, "press-1", port=7443)
        for axis in axes:
            direct.wait_online(axis)
            direct.to_done("Enable", axis)
            direct.to_done("SetPosition", axis, position=0.0)
        (budget,) = direct.call(direct.bus.GetBudget, bus_pb.GetBudgetRequest()).budgets
        bound = budget.stops[-1].last_frame.ToNanoseconds() / 1e6
        (log,) = pathlib.Path(self.cell.path("press-1")).glob("wire-*.log")
        took = []
        for number in range(rounds):
            for axis in axes:
                direct.motion("MoveVelocity", axis, velocity=20.0 if number % 2 == 0 else -20.0)
            for axis in axes:
                direct.wait_state(axis, lambda state: state.moving, f"{axis} moves")
            self.cell.kill("press-2", "axisd")
            self.cell.pause("press-3", "axisd")
            client, called = self.clients["press-1"], time.monotonic_ns()
            answer = client.call(client.cell.StopAll, cell_pb.StopAllRequest(reason="figures"), 10)
            assert [each.machine for each in answer.machines if each.outcome == cell_pb.MACHINE_OUTCOME_SILENT] == [
                "press-2", "press-3"], answer
            stops = {}
            for request in WireLog(str(log)).requests(since=called):
                if request.writes(STOP, 0):
                    stops.setdefault(request.node, request.time)
            assert len(stops) == len(axes), stops
            took.append((max(stops.values()) - called) / 1e6)
            self.cell.resume("press-3", "axisd")
            self.cell.start_axisd("press-2")
            wait_for(lambda: client.states() == dict.fromkeys(self.cell.machines, "PRESENT"), "all are present")
            client.call(client.cell.ReleaseStopAll, cell_pb.ReleaseStopAllRequest(), 10)
        line(f"StopAll, one machine dead and one frozen: last stop frame of the living one, bound {bound:.0f} ms", took, "ms")

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
        bench = Bench(cell.start_all(), chosen.axes)
        bench.stop_all(chosen.rounds)
        bench.stop_frames(chosen.rounds)
        bench.births_and_deaths(chosen.rounds)
        for watch in bench.watches.values():
            watch.close()
    finally:
        cell.close()


if __name__ == "__main__":
    main()
