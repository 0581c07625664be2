"""Machines, entrances and members of etcd fail, one by one and together; clients go on meanwhile. No command happens twice,
none is refused by a machine that answers, and nobody who answers is called dead. Times are printed; the limits are those
of the contract with room for a busy computer."""
import time
import unittest

from harness import CallFailed, wait_for
from rig import AXIS, CellClient, CellScenario, MachineWatch, Traffic

ROOM = 4.0  # s, for a computer that does other things as well


class Cells(CellScenario):
    def ready(self, **arguments):
        """Three machines, all present at every entrance."""
        cell = self.cell(**arguments).start_all()
        self.clients = {name: CellClient(cell, name) for name in cell.machines}
        self.present(cell)
        self.watches = {name: MachineWatch(client) for name, client in self.clients.items()}
        for watch in self.watches.values():
            self.addCleanup(watch.close)
            wait_for(lambda w=watch: w.changes, "the watch has begun")
        return cell

    def present(self, cell, limit=60.0):
        """Until every entrance says that every machine is present, and that its registry is whole."""
        begun = time.monotonic()
        whole = dict.fromkeys(cell.machines, "PRESENT")
        registry = "OK" if cell.members else "BY_HAND"

        def is_whole(name):
            try:
                return self.clients[name].states() == whole and self.clients[name].registry() == registry
            except CallFailed as failed:  # the connection of before, which a cut has ended
                if failed.code.name != "UNAVAILABLE":
                    raise
                return False
        for name in cell.machines:
            wait_for(lambda n=name: is_whole(n), f"all are present at {name}", limit)
        return time.monotonic() - begun

    def tell(self, text, seconds=None):
        print(f"{self.id()}: {text}" + ("" if seconds is None else f": {seconds:.2f} s"), flush=True)

    def seen(self, machine, state, after, limit, others=None):
        """When each entrance (but the machine's own) saw it."""
        for name in others or [name for name in self.watches if name != machine]:
            at = wait_for(lambda w=self.watches[name]: [at for at, to in w.states(machine, after) if to == state],
                          f"{machine} {state} at {name}")[0]
            self.tell(f"{machine} is {state} at {name}", at - after)
            self.assertLess(at - after, limit + ROOM)

    def nobody_was_called_dead(self, after, but=()):
        """Of those who answered all the time."""
        for name, watch in self.watches.items():
            for machine in self.watches:
                if machine not in but and name not in but:
                    states = {state for at, state in watch.states(machine, after)}
                    self.assertLessEqual(states, {"PRESENT", "UNREGISTERED"}, f"{machine} at {name}")


class BirthAndDeath(Cells):
    def test_of_a_daemon_and_of_a_computer(self):
        cell = self.ready()
        at = time.monotonic()
        cell.kill("press-3", "axisd")
        self.seen("press-3", "SILENT", at, 2, ["press-1", "press-2", "press-3"])
        cell.start_axisd("press-3")
        at = time.monotonic()  # it may have been seen a little earlier
        self.seen("press-3", "PRESENT", at - 0.5, 1.5, ["press-1", "press-2", "press-3"])

        at = time.monotonic()
        cell.cut("press-2")
        self.seen("press-2", "SILENT", at, 6, ["press-1", "press-3"])
        at = time.monotonic()
        cell.heal("press-2")
        self.tell("whole again after healing", self.present(cell))

        at = time.monotonic()
        cell.kill("press-1")
        self.seen("press-1", "SILENT", at, 6, ["press-2", "press-3"])
        cell.start_etcd("press-1")
        cell.start_axisd("press-1")
        cell.start_entrance("press-1")
        self.clients["press-1"].close()
        self.clients["press-1"] = CellClient(cell, "press-1")
        self.tell("whole again with the machine that lost its power", self.present(cell))

    def test_without_etcd(self):
        cell = self.ready(members=0)
        at = time.monotonic()
        cell.kill("press-3", "axisd")
        self.seen("press-3", "SILENT", at, 2, ["press-1", "press-2"])
        with self.assertRaises(CallFailed) as refused:
            CellClient(cell, "press-1", "press-3").state(AXIS)
        self.assertEqual((refused.exception.code.name, refused.exception.reason), ("UNAVAILABLE", "REASON_OFFLINE"))
        self.assertIn("press-3", refused.exception.detail.message)
        cell.start_axisd("press-3")
        self.present(cell)


class Etcd(Cells):
    """What etcd does is no affair of the machines."""

    def test_it_fails_while_machines_move(self):
        cell = self.ready(disks=True)
        etcd = cell.etcd
        traffic = Traffic(cell)
        self.addCleanup(traffic.end)
        begun = time.monotonic()

        leader = etcd.wait_leader()
        follower = next(name for name in cell.members if name != leader)
        self.tell(f"the follower {follower} dies")
        cell.kill(follower, "etcd")
        time.sleep(3)
        cell.start_etcd(follower)
        wait_for(lambda: etcd.healthy(follower), "the follower is back")

        leader = etcd.wait_leader()
        self.tell(f"the leader {leader} dies")
        cell.kill(leader, "etcd")
        time.sleep(5)
        self.tell("whole again with two members", self.present(cell))
        cell.start_etcd(leader)
        wait_for(lambda: etcd.healthy(leader), "the leader of before is back")
        self.present(cell)

        leader = etcd.wait_leader()
        others = [name for name in cell.members if name != leader]
        frozen = time.monotonic()
        how = cell.freeze(leader)
        # A leader without anything to write does not notice.
        wait_for(lambda: etcd.ask("root", "put", "/axisd/demo/hang", "x", "--command-timeout", "1s",
                                  members=others).returncode == 0, "another leads")
        time.sleep(max(0.0, frozen + 20 - time.monotonic()))
        cell.thaw(leader)
        self.tell(f"{how}, of {leader}", time.monotonic() - frozen)
        time.sleep(0.3)  # what etcd takes back it takes back now
        self.tell("whole again after the thaw", self.present(cell))

        self.tell("all members are gone for 30 s")
        for name in cell.members:
            cell.kill(name, "etcd")
        for name in cell.machines:
            wait_for(lambda n=name: self.clients[n].registry() == "DEGRADED", f"{name} says so")
        before = {reader.name: reader.answers for reader in traffic.readers}
        moved = [mover.done for mover in traffic.movers]
        time.sleep(30)
        for reader in traffic.readers:
            self.assertGreater(reader.answers, before[reader.name] + 20, reader.name)
        for mover, count in zip(traffic.movers, moved, strict=True):
            self.assertGreater(mover.done, count, mover.name)
        for name in cell.machines:
            self.assertEqual(self.clients[name].states(), dict.fromkeys(cell.machines, "PRESENT"))
        for name in cell.members:
            cell.start_etcd(name)
        for name in cell.members:
            wait_for(lambda n=name: etcd.healthy(n), f"etcd at {name}")
        self.tell("whole again after etcd is back", self.present(cell))

        self.nobody_was_called_dead(begun)
        traffic.judge(self)
        self.tell(traffic.figures())


class Partitions(Cells):
    def test_machines_are_cut_off_and_healed(self):
        """One with the leader, then one more: the rest goes on, and each request ends once."""
        cell = self.ready()
        traffic = Traffic(cell)
        self.addCleanup(traffic.end)
        leader = cell.etcd.wait_leader()
        other = next(name for name in cell.members if name != leader)
        for cut in ([leader], [other], [leader, other]):
            at = time.monotonic()
            cell.cut(*cut)
            rest = [name for name in cell.machines if name not in cut]
            for name in cut:
                self.seen(name, "SILENT", at, 6, rest)
            time.sleep(5)
            self.nobody_was_called_dead(at, but=cut)
            at = time.monotonic()
            cell.heal(*cut)
            self.present(cell)
            self.tell(f"whole again after {' and '.join(cut)} were healed", time.monotonic() - at)
        traffic.judge(self, readers=False)
        self.tell(traffic.figures())

    def test_machine_leader_and_entrance_die_together(self):
        cell = self.ready()
        traffic = Traffic(cell)
        self.addCleanup(traffic.end)
        leader = cell.etcd.wait_leader()
        rest = [name for name in cell.machines if name != leader]
        at = time.monotonic()
        # Its axisd goes on: what is judged afterwards is whether what it was asked for happened once.
        cell.kill(leader, "etcd", "cell")
        time.sleep(5)
        for name in rest:
            self.assertEqual(self.clients[name].states()[leader], "PRESENT")
        cell.start_etcd(leader)
        cell.start_entrance(leader)
        self.present(cell)
        self.tell("whole again", time.monotonic() - at)
        self.nobody_was_called_dead(at, but=[leader])
        traffic.judge(self, readers=False)
        self.tell(traffic.figures())


if __name__ == "__main__":
    unittest.main()
