"""axisctl and the Python package through real entrances, to real daemons with simulated drives."""
import asyncio
import json
import os
import re
import signal
import subprocess
import sys
import unittest

from client import package
from harness import AXISCTL, LIMIT, ROOT, pb, run, wait_for
from support import PRESENT, SILENT, CellScenario

import axisd  # made importable by support


def environment():
    """The test's own, without what tells clients where to go."""
    return {key: value for key, value in os.environ.items() if not key.startswith("AXISD")}


class ClientScenario(CellScenario):
    def axisctl(self, *words, through=0):
        return run([AXISCTL, "--cell", self.entrances[through].address, *words], limit=120, env=environment())

    def ok(self, *words, through=0):
        done = self.axisctl(*words, through=through)
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)
        return done.stdout

    def start(self, *words):
        running = subprocess.Popen([AXISCTL, "--cell", self.entrances[0].address, *words], env=environment(),
                                   text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        for close in (running.stderr.close, running.stdout.close, running.wait, running.kill):
            self.addCleanup(close)
        return running

    def enabled(self, *machines):
        for machine in machines:
            machine.client.to_done("Enable", "spinner")

    def starts(self):
        return [machine.sim.shaft().starts for machine in self.presses]


class Axisctl(ClientScenario):
    def test_every_machine_through_any_entrance(self):
        self.cell()
        self.assertEqual(self.ok("list", "--names", through=1).split(), [f"press-{n}/spinner" for n in (1, 2, 3)])
        self.assertEqual([line.split()[:2] for line in self.ok("machines").splitlines()[1:]],
                         [[f"press-{n}", "present"] for n in (1, 2, 3)])
        self.assertRegex(self.ok("info"), r"cell: +hall-1\n(?s:.*)registry: +ok")
        self.ok("enable", "press-1/spinner", "press-3/spinner", "--wait")
        moved = self.ok("move", "press-3/spinner", "1rev", "--relative", "--velocity", "5", "--wait")
        self.assertRegex(moved, r"press-3/spinner .*Done")
        self.assertEqual(self.starts(), [0, 0, 1])
        self.assertIn("press-2/spinner", self.ok("watch", "press-2", "--count", "1"))
        self.assertIn("Disabled", self.ok("state", "press-2/spinner"))
        self.assertIn("utilisation", self.ok("--json", "bus", "statistics", "press-2/line"))
        kept = re.findall(r"^(press-\d):$", self.ok("state"), re.MULTILINE)
        self.assertEqual(kept, ["press-1", "press-2", "press-3"])

    def test_a_repetition_through_another_entrance_moves_once(self):
        self.cell(2)
        self.enabled(self.presses[1])
        words = ("--json", "move", "press-2/spinner", "1", "--relative", "--request-id", "one", "--wait")
        first = json.loads(self.ok(*words))
        again = json.loads(self.ok(*words, through=1))
        self.assertEqual((first["id"], again["state"]), (again["id"], "COMMAND_STATE_DONE"))
        self.assertEqual(self.starts(), [0, 1])
        shown = self.ok("command", "get", first["id"], through=1)
        self.assertIn("press-2/spinner", shown)

    def test_jogs_and_halts(self):
        self.cell(2)
        self.enabled(self.presses[1])
        jogging = self.start("jog", "press-2/spinner", "2")
        self.presses[1].sim.wait_moving()
        jogging.send_signal(signal.SIGINT)
        out, err = jogging.communicate(timeout=LIMIT)
        self.assertEqual((jogging.returncode, err), (0, ""), out)
        self.presses[1].sim.wait_rest()
        self.assertEqual(self.starts()[0], 0)

    def test_stop_all_names_a_dead_machine_and_tells_by_its_status(self):
        self.cell()
        self.enabled(*self.presses)
        for machine in self.presses:
            machine.client.motion("MoveVelocity", "spinner", velocity=3.0)
            machine.sim.wait_moving()
        self.presses[2].daemon.kill()
        self.entrances[0].wait_for_state("press-3", SILENT)
        done = self.axisctl("stop", "--all", "--wait")
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        self.assertRegex(done.stdout, r"(?m)^press-1: stopped and latched, answered in ")
        self.assertRegex(done.stdout, r"(?m)^press-2/spinner .*Done|press-2/spinner.* Done")
        self.assertRegex(done.stdout, r"(?m)^press-3: SILENT, not confirmed: ")
        for machine in self.presses[:2]:
            self.assertFalse(machine.sim.shaft().moving)
        refused = self.axisctl("move", "press-2/spinner", "1", "--relative")
        self.assertEqual(refused.returncode, 4, refused.stderr)
        self.presses[2].start_daemon()
        self.entrances[0].wait_for_state("press-3", PRESENT)
        wait_for(lambda: self.presses[2].client.info().inhibited, "press-3 is told")
        self.ok("release-stop", "--all")
        self.ok("move", "press-2/spinner", "1", "--relative", "--wait")

    def test_a_frozen_machine_holds_up_no_stop_of_another(self):
        self.cell(2)
        self.enabled(*self.presses)
        for machine in self.presses:
            machine.client.motion("MoveVelocity", "spinner", velocity=3.0)
            machine.sim.wait_moving()
        frozen = self.presses[0].daemon.process
        frozen.send_signal(signal.SIGSTOP)
        try:
            stopping = self.start("--timeout", "30s", "stop", "press-1/spinner", "press-2/spinner")
            self.presses[1].sim.wait_rest()
        finally:
            frozen.send_signal(signal.SIGCONT)
        self.assertEqual(stopping.wait(LIMIT), 0, stopping.stderr.read())
        self.presses[0].sim.wait_rest()

    def test_events_of_machines_and_of_the_cell(self):
        self.cell(2)
        self.presses[1].daemon.kill()
        self.entrances[0].wait_for_state("press-2", SILENT)
        done = self.axisctl("events")
        self.assertIn(done.returncode, (0, 3), done.stderr)  # once it is gone, nobody asks it any more
        self.assertRegex(done.stdout, r"(?m)^\S+  \d+  press-2  .*silent")
        self.assertIn("press-1/spinner", done.stdout)


class Python(ClientScenario):
    def use(self, coroutine):
        async def within():
            async with axisd.connect_cell(self.entrances[0].address) as cell:
                return await asyncio.wait_for(coroutine(cell), 2 * LIMIT)
        return asyncio.run(within())

    def test_axes_of_machines_and_stop_all(self):
        self.cell(2)

        async def program(cell):
            machines = await cell.machines()
            self.assertEqual([machine.axes for machine in machines.values()],
                             [("press-1/spinner",), ("press-2/spinner",)])
            spinner = cell.axis("press-2/spinner")
            await spinner.enable()
            await spinner.move_relative(1)
            await spinner.velocity(3)
            async for state in spinner.watch(0.05):
                if state.moving:
                    break
            stopped = await cell.stop_all("test")
            self.assertEqual((stopped.failed, stopped.not_shared), ({}, None))
            with self.assertRaisesRegex(axisd.RefusedError, "press-2/spinner"):
                await spinner.move_relative(1)
            self.assertEqual((await cell.info()).stop_all[0].reason, "test")
            self.assertEqual((await cell.release_stop_all()).failed, {})
            await spinner.stop()
        self.use(program)
        self.assertFalse(self.presses[1].sim.shaft().moving)
        self.assertEqual(self.starts(), [0, 2])

    def test_a_lease_over_machines_is_all_or_none_and_each_owners_own(self):
        self.cell(2)

        async def program(cell):
            async with cell.lease("press-2/spinner", "press-1/spinner", ttl=3) as lease:
                self.assertEqual(sorted(lease.tokens), ["press-1", "press-2"])
                await lease.axis("press-1/spinner").enable()
                await lease.axis("press-1/spinner").move_relative(1)
                for name in lease.tokens:
                    self.assertEqual(len(await cell.machine(name).leases()), 1)
                with self.assertRaises(axisd.RefusedError):
                    async with cell.machine("press-2").lease("spinner"):
                        self.fail("it has two holders")
            for name in ("press-1", "press-2"):
                self.assertEqual(await cell.machine(name).leases(), [])
            async with cell.machine("press-2").lease("spinner", ttl=3):
                with self.assertRaisesRegex(axisd.RefusedError, r"\Apress-2/spinner: "):
                    async with cell.lease("press-1/spinner", "press-2/spinner"):
                        self.fail("it has two holders")
                self.assertEqual(await cell.machine("press-1").leases(), [])
        self.use(program)

    def test_a_machine_that_dies_ends_the_block_and_gives_the_others_back(self):
        self.cell(2)
        self.enabled(*self.presses)

        async def program(cell):
            with self.assertRaisesRegex(axisd.LeaseLostError, "press-2"):
                async with cell.lease("press-1/spinner", "press-2/spinner", ttl=2) as lease:
                    await lease.axis("press-1/spinner").velocity(3)
                    self.presses[1].daemon.kill()
                    await asyncio.sleep(2 * LIMIT)
            self.assertEqual(await cell.machine("press-1").leases(), [])
        self.use(program)
        self.presses[0].sim.wait_rest()  # what its on_lease_loss says

    def test_the_example(self):
        self.cell(2)
        done = subprocess.run(
            [sys.executable, ROOT / "api/python/examples/cell_transfer.py", "press-1/spinner=1", "press-2/spinner=-2",
             "--ttl", "10"],
            env=environment() | {"AXISD_CELL": self.entrances[1].address, "PYTHONPATH": str(package.load())},
            capture_output=True, text=True, timeout=LIMIT, check=False)
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)
        self.assertRegex(done.stdout, r"\Ahall-1, through press-2, registry Ok\n  press-1: Present(?s:.*)"
                                      r"press-1/spinner: Done, by 1\npress-2/spinner: Done, by -2\n\Z")
        self.assertEqual(self.starts(), [1, 1])
        self.assert_state(self.presses[0].client.state("spinner"), "STANDSTILL")
        self.assertEqual(pb.LinkState.Name(self.presses[0].client.state("spinner").link), "LINK_STATE_ONLINE")


if __name__ == "__main__":
    unittest.main()
