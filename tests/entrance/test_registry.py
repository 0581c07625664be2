"""Who is there: with etcd, without it, and whatever happens to it."""
import os
import pathlib
import signal
import socket
import threading
import time
import types
import unittest

from harness import run, system_pb, wait_for
from support import (AXISD_CELL, DEGRADED, GONE, HOST, OK, PRESENT, SILENT, CellScenario, cell_pb, seconds_until)


def answer_nonsense(listener):
    """Until it is closed."""
    while True:
        try:
            connection, _ = listener.accept()
        except OSError:
            return
        with connection:
            connection.sendall(b"220 welcome\r\n")


class Registry(CellScenario):
    def test_three_machines_know_each_other(self):
        self.cell()
        machine = self.entrances[0].machines()["press-3"]
        self.assertEqual(list(machine.axes), ["spinner"])
        self.assertEqual(machine.axisd_address, f"unix:{self.presses[2].socket}")
        self.assertEqual(machine.cell_address, self.entrances[2].address)
        self.assertTrue(machine.version and machine.configuration_revision and machine.machine_id)
        self.assertFalse(machine.own)
        self.assertGreater(machine.round_trip.nanos, 0)
        own = self.entrances[0].get()
        self.assertEqual((own.cell, own.machine, own.registry), ("hall-1", "press-1", OK))

    def test_births_and_deaths_are_seen_soon(self):
        self.cell(2)
        here = self.entrances[0]
        third = self.press(3)
        there = self.entrance(third, self.store, start=False)
        there.start(wait=False)
        seconds_until(lambda: here.state_of("press-3") == PRESENT, "press-3 is born")
        self.presses[1].daemon.kill()
        took = seconds_until(lambda: here.state_of("press-2") == SILENT, "press-2 is dead")
        self.assertLess(took, 20)  # 2 s on a computer that is not busy: tests/bench has the figures
        kinds = [(event.machine, event.to) for event in here.events()
                 if event.kind == cell_pb.CELL_EVENT_KIND_MACHINE]
        self.assertIn(("press-3", PRESENT), kinds)
        self.assertIn(("press-2", SILENT), kinds)
        self.presses[1].start_daemon()
        here.wait_for_state("press-2", PRESENT)

    def test_a_frozen_axisd_is_silent_and_present_again(self):
        self.cell(2)
        here, frozen = self.entrances[0], self.presses[1].daemon
        os.kill(frozen.process.pid, signal.SIGSTOP)
        try:
            here.wait_for_state("press-2", SILENT)
        finally:
            os.kill(frozen.process.pid, signal.SIGCONT)
        here.wait_for_state("press-2", PRESENT)

    def test_a_machine_that_is_killed_whole_is_gone_after_its_lease(self):
        self.cell(2)
        self.entrances[1].kill()
        self.presses[1].daemon.kill()
        self.entrances[0].wait_for_state("press-2", SILENT)
        self.entrances[0].wait_for_state("press-2", GONE)

    def test_an_entrance_that_ends_in_order_gives_its_registration_back(self):
        self.cell(2)
        self.entrances[1].stop()
        wait_for(lambda: not self.store.value("machines/press-2"), "the key is gone", limit=4)  # the lease has 5 s
        self.entrances[0].wait_for_state("press-2", cell_pb.MACHINE_STATE_UNREGISTERED)

    def test_without_etcd_everything_goes_on(self):
        self.cell(2)
        here = self.entrances[0]
        self.store.kill()
        wait_for(lambda: here.get().registry == DEGRADED, "it is degraded")
        self.assertIn("etcd", here.get().registry_trouble.message)
        self.assertEqual({name: m.state for name, m in here.machines().items()},
                         {"press-1": PRESENT, "press-2": PRESENT})
        time.sleep(6)  # longer than the leases
        self.assertEqual(here.state_of("press-2"), PRESENT)
        # A restart knows what was known.
        here.kill()
        here.start()
        here.wait_for_state("press-2", PRESENT)
        self.assertEqual(list(here.machines()["press-2"].axes), ["spinner"])
        for index in range(self.store.members):
            self.store.start_member(index)
        self.store.wait_healthy()
        wait_for(lambda: [e.get().registry for e in self.entrances] == [OK, OK], "both are registered again")

    def test_an_etcd_that_forgets_everything_is_told_again(self):
        self.cell(2)
        self.store.ctl("del", "--prefix", "/axisd/")
        for entrance in self.entrances:
            self.wait_whole(entrance, 2)
        wait_for(lambda: all(self.store.value(f"machines/press-{n}") for n in (1, 2)), "both keys are there")

    def test_leases_that_are_revoked_are_no_deaths(self):
        self.cell(2)
        here = self.entrances[0]
        before = len([e for e in here.events() if e.to in (SILENT, GONE)])
        leases = self.store.ctl("lease", "list").stdout.split()[-2:]
        for lease in leases:
            self.store.ctl("lease", "revoke", lease)
        for entrance in self.entrances:
            self.wait_whole(entrance, 2)
        self.assertEqual(len([e for e in here.events() if e.to in (SILENT, GONE)]), before, "nobody was called dead")

    def test_a_member_that_is_killed_is_left(self):
        self.cell(2, members=3)
        here = self.entrances[0]
        for index in (0, 1):  # one at a time: two of three are a quorum
            self.store.kill_member(index)
            wait_for(lambda: self.store.ctl("endpoint", "health", "--command-timeout=2s",
                                            endpoint=self.store.client(2)).returncode == 0, "two have a leader")
            for entrance in self.entrances:
                self.wait_whole(entrance, 2)
            self.store.start_member(index)
            wait_for(lambda i=index: self.store.ctl("endpoint", "health", "--command-timeout=2s",
                                                    endpoint=self.store.client(i)).returncode == 0, "it is back")
        self.assertEqual(here.state_of("press-2"), PRESENT)

    def test_the_second_machine_of_a_name_is_refused_and_says_who_has_it(self):
        self.cell(1)
        other = self.press(1)
        second = self.entrance(other, self.store)
        wait_for(lambda: "another computer" in second.get().registry_trouble.message, "it is refused")
        self.assertEqual(second.get().registry, DEGRADED)
        self.assertIn(self.presses[0].socket, second.get().registry_trouble.message)
        self.assertIn(cell_pb.CELL_EVENT_KIND_CONFLICT, [event.kind for event in second.events()])
        self.assertEqual(self.entrances[0].get().registry, OK)
        # What is known of the name is the first one's, for others; its own axisd is its own for each entrance.
        self.assertEqual(second.at(None, second.client.system.GetInfo, system_pb.GetInfoRequest()).instance_id,
                         other.client.info().instance_id)
        self.entrances[0].stop()
        wait_for(lambda: second.get().registry == OK, "the name is free")

    def test_the_same_computer_takes_its_name_back_at_once(self):
        self.cell(1)
        here = self.entrances[0]
        here.kill()  # its lease goes on for 5 s
        here.start()
        wait_for(lambda: here.get().registry == OK, "it has its name back", limit=4)

    def test_a_damaged_registry_file_is_put_aside(self):
        self.cell(2)
        here = self.entrances[0]
        here.kill()
        file = pathlib.Path(here.state) / "registry"
        file.write_bytes(file.read_bytes()[:-3] + b"xyz")
        here.start()
        self.assertTrue(pathlib.Path(f"{file}.damaged").exists())
        self.assertTrue(any("damaged" in event.text for event in here.events()))
        self.wait_whole(here, 2)

    def test_what_strangers_write_into_etcd_is_not_believed(self):
        self.cell(1)
        here = self.entrances[0]
        for key, value in (("machines/evil", "garbage"), ("machines/UPPER", ""), ("machines/a/b", "x"), ("stop_all", "x")):
            self.store.ctl("put", f"/axisd/hall-1/{key}", value)
        time.sleep(1)
        self.assertEqual(list(here.machines()), ["press-1"])
        self.assertEqual(here.get().registry, OK)
        self.assertEqual(len(here.get().stop_all), 0)

    def test_wrong_endpoints_are_told_and_passed_over(self):
        """Where nobody listens, where something else does, and where another service of gRPC does."""
        listener = socket.create_server((HOST, 0))
        self.addCleanup(listener.close)
        threading.Thread(target=answer_nonsense, args=(listener,), daemon=True).start()
        other = self.entrance(self.press(9))
        wrong = [f"{HOST}:1", f"{HOST}:{listener.getsockname()[1]}", other.address]
        here = self.entrance(self.press(1), types.SimpleNamespace(endpoints=wrong))
        for endpoint in wrong:
            wait_for(lambda e=endpoint: e in here.get().registry_trouble.message, f"{endpoint} is named")
        self.assertEqual(here.get().registry, DEGRADED)
        self.assertTrue(here.get().registry_trouble.remedy)
        here.wait_for_state("press-1", PRESENT)
        self.assertEqual(here.client.info().machine, "press-1")
        here.stop()
        here.etcd = types.SimpleNamespace(endpoints=[*wrong, *self.etcd().endpoints])
        here.start()
        wait_for(lambda: here.get().registry == OK, "the last one is etcd")

    def test_watching_tells_the_whole_list_and_then_changes(self):
        self.cell(2)
        stream = self.entrances[0].client.cell.WatchMachines(cell_pb.WatchMachinesRequest(), timeout=60)
        self.assertEqual([machine.name for machine in next(stream).machines], ["press-1", "press-2"])
        self.presses[1].daemon.kill()
        for message in stream:
            self.assertEqual([machine.name for machine in message.machines if machine.name != "press-2"], [])
            if message.machines and message.machines[0].state == SILENT:
                break
        stream.cancel()

    def test_the_command_line(self):
        machine = self.press(1, start=False)
        entrance = self.entrance(machine, start=False)
        pathlib.Path(entrance.config).write_text(entrance.text())
        done = run([AXISD_CELL, "--config", entrance.config, "--check"])
        self.assertEqual((done.returncode, done.stdout), (0, f"{entrance.config}: ok\n"), done.stderr)
        pathlib.Path(entrance.config).write_text("cell: X\n")
        done = run([AXISD_CELL, "--config", entrance.config, "--check"])
        self.assertEqual(done.returncode, 2)
        self.assertIn(f"{entrance.config}:1:7: ", done.stderr)
        done = run([AXISD_CELL, "--nonsense"])
        self.assertEqual(done.returncode, 2)
        self.assertTrue(run([AXISD_CELL, "--version"]).stdout.startswith("axisd-cell "))


if __name__ == "__main__":
    unittest.main()
