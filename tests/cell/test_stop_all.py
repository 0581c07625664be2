"""StopAll of the cell: over the connections, never through etcd; told again to whoever comes back; released explicitly."""
import time
import unittest

from harness import CallFailed, wait_for
from rig import CellClient, CellScenario, cell_pb

DONE, SILENT = cell_pb.MACHINE_OUTCOME_DONE, cell_pb.MACHINE_OUTCOME_SILENT
AXES = ["spindle-1", "spindle-2"]


class StopAll(CellScenario):
    def ready(self, **arguments):
        cell = self.cell(**arguments).start_all()
        self.direct = {name: CellClient(cell, name, port=7443) for name in cell.machines}
        for name, client in self.direct.items():
            for axis in AXES:
                client.wait_online(axis)
                client.to_done("Enable", axis)
                client.to_done("SetPosition", axis, position=-450.0)
        for name in cell.machines:
            client = CellClient(cell, name)
            wait_for(lambda c=client: c.states() == dict.fromkeys(cell.machines, "PRESENT"), f"all are present at {name}")
            client.close()
        return cell

    def run_all(self, machines):
        for name in machines:
            for axis in AXES:
                self.direct[name].motion("MoveAbsolute", axis, position=450.0, velocity=20.0)
        for name in machines:
            for axis in AXES:
                self.direct[name].wait_state(axis, lambda s: s.moving, f"{name}/{axis} moves")

    def stop(self, client):
        """The answer as a dictionary, and how long it took."""
        begun = time.monotonic()
        answer = client.call(client.cell.StopAll, cell_pb.StopAllRequest(reason="try"), 10)
        took = time.monotonic() - begun
        print(f"{self.id()}: StopAll answered after {took:.3f} s", flush=True)
        return {machine.machine: machine for machine in answer.machines}, took

    def release(self, client):
        return client.call(client.cell.ReleaseStopAll, cell_pb.ReleaseStopAllRequest(), 10)

    def is_latched(self, name):
        return self.direct[name].info().inhibited

    def stands(self, name):
        for axis in AXES:
            self.direct[name].wait_state(axis, lambda s: not s.moving, f"{name}/{axis} stands")

    def test_all_stop_whatever_etcd_does(self):
        cell = self.ready()
        self.run_all(cell.machines)
        for name in cell.members:
            cell.kill(name, "etcd")
        client = CellClient(cell, "press-2")
        machines, took = self.stop(client)
        self.assertEqual({name: machine.outcome for name, machine in machines.items()}, dict.fromkeys(cell.machines, DONE))
        self.assertLess(took, 5.0)
        for name in cell.machines:
            self.stands(name)
            self.assertTrue(self.is_latched(name))
        released = self.release(client)
        self.assertEqual({machine.machine: machine.outcome for machine in released.machines},
                         dict.fromkeys(cell.machines, DONE))
        for name in cell.machines:
            wait_for(lambda n=name: not self.is_latched(n), f"{name} is released")
            self.assertFalse(self.direct[name].state(AXES[0]).moving)

    def test_one_dead_one_frozen_and_who_comes_back(self):
        """The dead one is latched before it moves; the frozen one when it goes on, and no entrance forgets over a restart."""
        cell = self.ready()
        self.run_all(["press-1"])
        cell.kill("press-2", "axisd")
        cell.pause("press-3", "axisd")
        client = CellClient(cell, "press-1")
        machines, took = self.stop(client)
        self.assertEqual({name: machine.outcome for name, machine in machines.items()},
                         {"press-1": DONE, "press-2": SILENT, "press-3": SILENT})
        self.assertLess(took, 5.0)
        self.stands("press-1")

        for name in ("press-1", "press-2", "press-3"):  # who knows of it is killed as well, one after the other
            cell.kill(name, "cell")
            cell.start_entrance(name)
        cell.resume("press-3", "axisd")
        wait_for(lambda: self.is_latched("press-3"), "the frozen one is told")
        cell.start_axisd("press-2")
        self.direct["press-2"].close()
        self.direct["press-2"].connect()
        wait_for(lambda: self.is_latched("press-2"), "the dead one is told")
        with self.assertRaises(CallFailed) as refused:
            self.direct["press-2"].motion("MoveRelative", AXES[0], distance=1.0)
        self.assertEqual(refused.exception.code.name, "FAILED_PRECONDITION")

        client = CellClient(cell, "press-3")
        # A release is for those that answer: one that does not is told of the stop again, and not of the release.
        wait_for(lambda: client.states() == dict.fromkeys(cell.machines, "PRESENT"), "all are present")
        released = self.release(client)
        self.assertEqual({machine.machine: machine.outcome for machine in released.machines},
                         dict.fromkeys(cell.machines, DONE))
        for name in cell.machines:
            wait_for(lambda n=name: not self.is_latched(n), f"{name} is released")
        time.sleep(3)
        for name in cell.machines:
            self.assertFalse(self.is_latched(name), f"{name} was told again after the release")

    def test_a_machine_that_is_cut_off_is_told_when_it_is_back(self):
        cell = self.ready()
        cell.cut("press-3")
        client = CellClient(cell, "press-1")
        wait_for(lambda: client.states()["press-3"] == "SILENT", "press-3 is silent")
        machines, _ = self.stop(client)
        self.assertEqual(machines["press-3"].outcome, SILENT)
        cell.heal("press-3")
        self.direct["press-3"].close()
        self.direct["press-3"].connect()
        wait_for(lambda: self.is_latched("press-3"), "press-3 is told")
        self.release(client)

    def test_a_release_is_a_maintainers(self):
        cell = self.ready()
        self.stop(CellClient(cell, "press-1", user="cell.press-2"))
        with self.assertRaises(CallFailed) as refused:
            self.release(CellClient(cell, "press-1", user="cell.press-2"))
        self.assertEqual(refused.exception.code.name, "PERMISSION_DENIED")
        for name in cell.machines:
            self.assertTrue(self.is_latched(name))
            asked = CellClient(cell, name)
            (latch,) = wait_for(lambda c=asked: c.call(c.cell.GetCell, cell_pb.GetCellRequest()).stop_all,
                                f"{name} knows of it")
            self.assertEqual((latch.by, latch.reason, latch.entrance), ("cell.press-2", "try", "press-1"))


if __name__ == "__main__":
    unittest.main()
