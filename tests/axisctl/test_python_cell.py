"""The Python package against a fake cell of machines with simulated drives: what real cells do not do when a test wants it."""
import asyncio
import signal
import unittest
from unittest import mock

import fake_cell  # makes axisd and the harness importable
import axisd
from axisd.types import in_cell
from harness.programs import OWN_NAME

LIMIT = 60


class CellTest(unittest.IsolatedAsyncioTestCase):
    async def asyncSetUp(self):
        self.fake = fake_cell.FakeCell(("press-1", "press-2", "press-3"))
        servers, port = await self.fake.serve()
        for server in servers:
            self.addAsyncCleanup(server.stop, 0)
        self.address = f"127.0.0.1:{port}"
        self.cell = await self.enterAsyncContext(axisd.connect_cell(self.address, timeout=2))

    def calls(self, machine, method):
        return self.fake.machines[machine].requests(method)


class Machines(CellTest):
    async def test_which_there_are(self):
        machines = await self.cell.machines()
        self.assertEqual(list(machines), ["press-1", "press-2", "press-3"])
        two = machines["press-2"]
        self.assertEqual((two.state, two.axes[0], two.version, two.round_trip, two.stop_all, two.own),
                         (axisd.MachineState.PRESENT, "press-2/feeder", "0.1.0", 0.0004, False, False))
        self.fake.machines["press-3"].axes.clear()
        self.assertIsNone((await self.cell.machines())["press-3"].axes, "known by hand: nobody asked for them")
        info = await self.cell.info()
        self.assertEqual((info.cell, info.machine, info.registry, info.client, info.stop_all),
                         ("hall-1", "press-1", axisd.Registry.OK, "anna", ()))

    async def test_changes_as_they_come(self):
        watched = self.cell.watch_machines()
        self.assertEqual(len(await anext(watched)), 3)
        await self.fake.fall_silent("press-3")
        machines = await anext(watched)
        self.assertIs(machines["press-3"].state, axisd.MachineState.SILENT)
        self.assertFalse(machines["press-3"].state.answers)
        self.assertEqual(machines["press-3"].trouble, "connection refused")
        self.assertIs(machines["press-1"].state, axisd.MachineState.PRESENT)
        await watched.aclose()

    async def test_events_go_on_at_their_cursor(self):
        for name in ("press-2", "press-3"):
            await self.fake.fall_silent(name)
        events = self.cell.events(kept=True)
        first = await anext(events)
        self.assertEqual((first.kind, first.machine, first.text),
                         ("machine", "press-2", "present -> silent: connection refused"))
        await events.aclose()
        events = self.cell.events(after=first.cursor)
        self.assertEqual((await anext(events)).machine, "press-3")
        await events.aclose()


class Axes(CellTest):
    async def test_an_axis_works_like_that_of_a_single_machine(self):
        feeder = self.cell.axis("press-2/feeder")
        await feeder.move(30)
        self.assertEqual((await feeder.state()).position, 30)
        self.assertEqual((await self.cell.axis("press-1/feeder").state()).position, 0)
        self.assertEqual(self.calls("press-1", "MoveAbsolute"), [])
        async with feeder.jog(30, hold=0.3):
            await asyncio.sleep(0)
        self.assertEqual(len(self.calls("press-2", "Halt")), 1)
        async for state in feeder.watch(0.05):
            self.assertGreaterEqual(state.position, 30)
            break
        await self.cell.machine("press-2").stop_all()
        self.assertTrue((await feeder.state()).inhibited)
        self.assertFalse((await self.cell.axis("press-1/feeder").state()).inhibited)

    async def test_errors_name_the_machine(self):
        sticky = self.fake.machines["press-2"].daemon
        sticky.simulate("block", "sticky", "on")
        with self.assertRaises(axisd.MotionError) as raised:
            await self.cell.axis("press-2/sticky").move_relative(90)
        sticky.simulate("block", "sticky", "off")
        self.assertRegex(str(raised.exception), r"\Apress-2/sticky: move_relative Error: ")
        with self.assertRaisesRegex(axisd.RefusedError, r"\Apress-2/feeder: target 500 mm"):
            await self.cell.axis("press-2/feeder").move(500)
        with self.assertRaisesRegex(axisd.RefusedError, r"\Apress-9/feeder: there is no machine 'press-9'"):
            await self.cell.axis("press-9/feeder").state()
        with self.assertRaisesRegex(axisd.RefusedError, "press-1/ghost: .*no reply"):
            await self.cell.axis("press-1/ghost").enable()  # a drive, and no machine
        await self.cell.machine("press-2").stop_all()
        with self.assertRaises(axisd.RefusedError) as refused:
            await self.cell.axis("press-2/feeder").move(5)
        self.assertIn("axisctl --machine press-2 release-stop --all", str(refused.exception))
        self.assertEqual(refused.exception.remedy, refused.exception.detail.remedy)
        for name in ("feeder", "/feeder", "press-2/"):
            with self.assertRaises(axisd.ArgumentError):
                self.cell.axis(name)

    async def test_a_silent_machine_is_unreachable_and_nothing_was_sent(self):
        self.fake.silent.add("press-2")
        with self.assertRaises(axisd.UnreachableError) as raised:
            await self.cell.axis("press-2/feeder").move(5, request_id="abc")
        self.assertEqual((raised.exception.nothing_sent, raised.exception.request_id), (True, "abc"))
        self.assertEqual(str(raised.exception),
                         "press-2/feeder: does not answer: connection refused; look at the machine")

    async def test_a_stop_is_repeated_until_the_machine_is_back(self):
        self.fake.silent.add("press-2")
        stopping = asyncio.create_task(self.cell.axis("press-2/feeder").stop())
        while self.fake.forwarded.count(("press-2", "Stop")) < 2:
            await asyncio.sleep(0.01)
        self.fake.silent.clear()
        self.assertIs((await stopping).state, axisd.CommandState.DONE)

    async def test_no_entrance(self):
        async with axisd.connect_cell("127.0.0.1:1", timeout=0.3) as nowhere:
            with self.assertRaisesRegex(axisd.UnreachableError, "no answer from axisd-cell at 127.0.0.1:1: "):
                await nowhere.machines()
            with self.assertRaisesRegex(axisd.UnreachableError, "the stop was repeated for 0.3 s: it never arrived"):
                await nowhere.stop_all()
        with mock.patch.dict("os.environ", AXISD_CELL="press-7"):
            self.assertEqual(axisd.connect_cell().server, "press-7:7445")


class Groups(CellTest):
    async def test_axes_of_several_machines_move_from_one_moment_on(self):
        async with self.cell.lease("press-1/feeder", "press-2/feeder") as lease:
            tokens = lease.tokens
            move = await self.cell.move({"press-1/feeder": 10, "press-2/feeder": 20, "press-3/feeder": 30},
                                        velocity={"press-2/feeder": 5}, clock_tolerance=0.002, lease=lease)
        self.assertEqual((move.state, move.start_skew, move.start_skew_error), (axisd.CommandState.DONE, 0.002, 0.0001))
        self.assertEqual(move.machines["press-2"].started_after, 0.002)
        self.assertEqual(move.machines["press-2"].move.members["feeder"].command.state, axisd.CommandState.DONE)
        (request,) = self.fake.moves
        self.assertEqual([(part.machine, part.lease_token) for part in request.machines],
                         [("press-1", tokens["press-1"]), ("press-2", tokens["press-2"]), ("press-3", 0)])
        self.assertEqual(request.machines[1].targets[0].velocity, 5)
        self.assertEqual(request.clock_tolerance.nanos, 2_000_000)

    async def test_what_failed_names_its_machine(self):
        with self.assertRaises(axisd.MotionError) as raised:
            await self.cell.move({"press-1/feeder": 10, "press-2/sticky": 20})
        self.assertEqual((raised.exception.machine, raised.exception.command.axis), ("press-2", "sticky"))
        self.assertIn("press-2/sticky", str(raised.exception))
        self.fake.silent.add("press-3")
        with self.assertRaises(axisd.UnreachableError) as lost:
            await self.cell.move({"press-1/feeder": 10, "press-3/feeder": 20})
        self.assertTrue(lost.exception.nothing_sent)
        with self.assertRaises(axisd.ArgumentError):
            await self.cell.move({"feeder": 10})


class Advice(unittest.TestCase):
    def test_it_is_given_for_the_entrance(self):
        for told, meant in {
                "look at it; axisctl reset feeder": "look at it; axisctl reset press-2/feeder",
                "acquire one: axisctl lease acquire feeder, and give its token":
                    "acquire one: axisctl lease acquire press-2/feeder, and give its token",
                "accept it: axisctl state, axisctl state accept":
                    "accept it: axisctl --machine press-2 state, axisctl --machine press-2 state accept",
                "axisctl machines shows those of the cell": "axisctl machines shows those of the cell",
                "check its power": "check its power"}.items():
            self.assertEqual(in_cell(told, "press-2", "feeder"), meant)
        self.assertEqual(in_cell("axisctl home home", "press-2", "home"), "axisctl home press-2/home")


class StopAll(CellTest):
    async def test_every_machine_and_its_release(self):
        stopped = await self.cell.stop_all("somebody is inside")
        self.assertEqual((stopped.failed, stopped.latch.reason, self.fake.reasons),
                         ({}, "somebody is inside", ["somebody is inside"]))
        self.assertEqual([stop.machine for stop in stopped.machines], ["press-1", "press-2", "press-3"])
        self.assertEqual(stopped.machines[1].axes[0].axis, "feeder")
        with self.assertRaisesRegex(axisd.RefusedError, "press-3/feeder: .*release-stop --all"):
            await self.cell.axis("press-3/feeder").move(1)
        self.assertEqual((await self.cell.release_stop_all()).failed, {})
        await self.cell.axis("press-3/feeder").stop()  # until it rests
        await self.cell.axis("press-3/feeder").move(1)

    async def test_names_the_silent(self):
        self.fake.silent.add("press-2")
        stopped = await self.cell.stop_all()
        self.assertEqual(list(stopped.failed), ["press-2"])
        self.assertIs(stopped.failed["press-2"].outcome, axisd.MachineOutcome.SILENT)
        self.assertEqual(str(stopped.failed["press-2"]),
                         "press-2: press-2: does not answer: connection refused; look at the machine")
        released = await self.cell.release_stop_all()
        self.assertEqual((list(released.failed), len(released.released)), (["press-2"], 1))


class Leases(CellTest):
    async def test_one_per_owner_in_the_order_of_names(self):
        async with self.cell.lease("press-2/feeder", "press-1/turntable", "press-2/sticky", ttl=3,
                                   label="cell 4") as lease:
            taken = [name for name, method in self.fake.forwarded if method == "AcquireLease"]
            self.assertEqual(taken, ["press-1", "press-2"])
            self.assertEqual(list(lease.infos["press-2"].axes), ["feeder", "sticky"])
            await lease.axis("press-2/feeder").move(5)
            while min(len(self.calls(name, "RenewLease")) for name in ("press-1", "press-2")) < 2:
                await asyncio.sleep(0.05)
            with self.assertRaises(axisd.ArgumentError):
                lease.axis("press-3/feeder")
        self.assertEqual(self.calls("press-2", "MoveAbsolute")[0].options.lease_token, lease.tokens["press-2"])
        self.assertEqual([len(self.calls(name, "ReleaseLease")) for name in self.fake.machines], [1, 1, 0])

    async def test_all_or_none(self):
        async with self.cell.machine("press-2").lease("feeder"):
            with self.assertRaisesRegex(axisd.RefusedError, f"press-2/feeder: leased by {OWN_NAME}"):
                async with self.cell.lease("press-1/feeder", "press-2/feeder", "press-3/feeder"):
                    self.fail("it has two holders")
            self.assertEqual(self.fake.machines["press-1"].leases, [])
            self.assertEqual(self.calls("press-3", "AcquireLease"), [])

    async def test_a_silent_machine_takes_none(self):
        self.fake.silent.add("press-2")
        with self.assertRaisesRegex(axisd.UnreachableError, "press-2/feeder: does not answer"):
            async with self.cell.lease("press-2/feeder", "press-1/feeder"):
                self.fail("one machine is silent")
        self.assertEqual(self.fake.machines["press-1"].leases, [])

    async def test_one_that_is_lost_gives_the_others_back(self):
        reached = []
        with self.assertRaisesRegex(axisd.LeaseLostError, "press-2: .*took the lease"):
            async with self.cell.lease("press-1/feeder", "press-2/feeder", ttl=3):
                self.fake.machines["press-2"].daemon.take("feeder")
                await asyncio.sleep(LIMIT)
                reached.append("the end")
        self.assertEqual((reached, self.fake.machines["press-1"].leases), ([], []))
        self.assertEqual([len(self.calls(name, "ReleaseLease")) for name in ("press-1", "press-2")], [1, 0])
        await asyncio.sleep(0)  # no cancellation is left over

    async def test_a_machine_that_falls_silent_costs_its_time_to_live(self):
        begun = asyncio.get_running_loop().time()
        with self.assertRaisesRegex(axisd.LeaseLostError, "press-2: does not answer"):
            async with self.cell.lease("press-1/feeder", "press-2/feeder", ttl=1):
                await self.fake.fall_silent("press-2")
                await asyncio.sleep(LIMIT)
        self.assertGreaterEqual(asyncio.get_running_loop().time() - begun, 1)
        self.assertEqual(self.fake.machines["press-1"].leases, [])

    async def test_a_cancelled_acquisition_gives_back(self):
        held = self.fake.holding["press-2", "AcquireLease"] = asyncio.Event()
        taking = asyncio.create_task(self.take_both())
        await held.wait()
        self.assertEqual(len(self.fake.machines["press-1"].leases), 1)
        taking.cancel()
        with self.assertRaises(asyncio.CancelledError):
            await taking
        self.assertEqual(self.fake.machines["press-1"].leases, [])

    async def take_both(self):
        async with self.cell.lease("press-1/feeder", "press-2/feeder"):
            self.fail("one machine never answered")


if __name__ == "__main__":
    signal.alarm(600)  # a hang names itself instead of blocking a test run
    unittest.main()
