"""The Python package against the daemon with simulated drives."""
import asyncio
import datetime
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import unittest

import canned  # makes axisd importable
from between import Open
from harness.programs import OWN_NAME
from support import PythonTest
import axisd

ROOT = pathlib.Path(__file__).resolve().parents[2]


class ClientTest(PythonTest):
    def peers(self, method):
        return set(self.between.peers(method))


class Motion(ClientTest):
    async def test_power_home_move_until_done(self):
        await self.feeder.enable()
        await self.feeder.home()
        result = await self.feeder.move(30, velocity=199, acceleration_time=0.15,
                                        deceleration_time=datetime.timedelta(milliseconds=200))
        self.assertIs(result.state, axisd.CommandState.DONE)
        self.assertEqual((result.kind, result.asked.velocity), ("move_absolute", 199))
        self.assertAlmostEqual(result.granted.velocity, 74 * 8 / 3)
        state = await self.feeder.state()
        self.assertEqual((state.position, state.state, state.trust), (30, axisd.State.STANDSTILL, axisd.Trust.HOMED))
        (request,) = self.calls("MoveAbsolute")
        self.assertEqual((request.acceleration_time.nanos, request.deceleration_time.nanos),
                         (150_000_000, 200_000_000))

    async def test_log_level(self):
        self.assertEqual(await self.machine.log_level(), "info")
        self.assertEqual(await self.machine.log_level("debug"), "info")
        self.assertEqual(await self.machine.log_level(), "debug")

    async def test_zero_is_a_value(self):
        await self.feeder.set_position(5)
        await self.feeder.move(0)
        self.assertTrue(self.calls("MoveAbsolute")[0].HasField("position"))
        self.assertFalse(self.calls("MoveAbsolute")[0].HasField("velocity"))

    async def test_what_is_no_number_is_not_sent(self):
        with self.assertRaisesRegex(axisd.ArgumentError, "position: '120mm' is no number; write it without a unit"):
            await self.feeder.move("120mm")
        with self.assertRaisesRegex(axisd.ArgumentError, "velocity: '5mm/s' is no number"):
            await self.feeder.move_relative(5, velocity="5mm/s")
        with self.assertRaisesRegex(axisd.ArgumentError, "feeder: '5' is no number"):
            await self.machine.group(axes=["feeder"]).move({"feeder": "5"})
        self.assertFalse(self.calls("MoveAbsolute") + self.calls("MoveRelative") + self.calls("MoveGroup"))

    async def test_move_relative(self):
        await self.feeder.set_position(100)
        await self.feeder.move_relative(-10)
        self.assertEqual((await self.feeder.state()).position, 90)

    async def test_without_waiting(self):
        command = await self.feeder.move(60, velocity=300, wait=False)
        self.assertFalse(command.state.ended)
        self.assertIs((await self.machine.wait(command)).state, axisd.CommandState.DONE)
        self.assertIs((await self.machine.command(command.id)).state, axisd.CommandState.DONE)

    async def test_a_motion_that_ends_otherwise_raises(self):
        self.daemon.simulate("block", "sticky", "on")
        with self.assertRaises(axisd.MotionError) as raised:
            await self.machine.axis("sticky").move_relative(90)
        self.daemon.simulate("block", "sticky", "off")
        self.assertEqual(raised.exception.reason, "not_reached")
        self.assertIs(raised.exception.command.state, axisd.CommandState.ERROR)
        self.assertRegex(str(raised.exception), "^sticky: move_relative Error: .*the drive came to rest at .* from its target; "
                                                "check what holds")
        await self.machine.axis("sticky").reset()

    async def test_a_halt_ends_a_waiting_move(self):
        moving = asyncio.create_task(self.feeder.move(390, velocity=9))
        while not self.calls("MoveAbsolute"):
            await asyncio.sleep(0.01)
        await self.feeder.halt()
        with self.assertRaises(axisd.MotionError) as raised:
            await moving
        self.assertEqual(raised.exception.reason, "superseded")
        self.assertNotEqual(self.peers("Halt"), self.peers("MoveAbsolute"))

    async def test_cancelling_the_call_leaves_the_motion_alone(self):
        with self.assertRaises(TimeoutError):
            await asyncio.wait_for(self.feeder.move(390, velocity=9), 0.2)
        self.assertTrue((await self.feeder.state()).moving)

    async def test_a_repeated_request_id_attaches(self):
        first = await self.feeder.move_relative(5, request_id="abc")
        second = await self.feeder.move_relative(5, request_id="abc")
        self.assertEqual(first.id, second.id)

    async def test_velocity_with_hold_and_cancel(self):
        command = await self.feeder.velocity(30, hold=0.3)
        with self.assertRaisesRegex(axisd.MotionError, "the hold was not renewed in time"):
            await self.machine.wait(command)
        command = await self.feeder.velocity(9)
        await self.machine.cancel(command.id)
        with self.assertRaises(axisd.MotionError) as raised:
            await self.machine.wait(command)
        self.assertIs(raised.exception.command.state, axisd.CommandState.ABORTED)
        self.assertEqual(raised.exception.reason, "cancelled")

    async def test_stop_held_and_quick_stop(self):
        await self.feeder.stop(hold=True)
        self.assertTrue((await self.feeder.state()).stop_held)
        await self.feeder.release_stop()
        self.assertFalse((await self.feeder.state()).stop_held)
        self.assertEqual((await self.feeder.quick_stop()).kind, "quick_stop")
        await self.feeder.disable()
        self.assertIs((await self.feeder.state()).state, axisd.State.DISABLED)


class Jogging(ClientTest):
    async def test_renews_inside_the_block_and_halts_after(self):
        async with self.feeder.jog(30, hold=0.3) as jog:
            await asyncio.sleep(0.9)  # longer than the hold: only renewals keep it moving
            self.assertIs((await self.machine.command(jog.command.id)).state, axisd.CommandState.ACTIVE)
        self.assertFalse((await self.feeder.state()).moving)
        calls = self.calls("Jog")
        self.assertGreater(len(calls), 2)
        self.assertEqual(len({call.options.request_id for call in calls}), 1)  # a repeat extends the hold
        self.assertEqual(len(self.calls("Halt")), 1)

    async def test_halts_when_the_block_raises(self):
        with self.assertRaises(ZeroDivisionError):
            async with self.feeder.jog(30):
                raise ZeroDivisionError
        self.assertEqual(len(self.calls("Halt")), 1)

    async def test_a_stop_ends_it_and_it_is_not_started_again(self):
        with self.assertRaises(axisd.MotionError):
            async with self.feeder.jog(9, hold=0.3):
                await self.feeder.stop()
                await asyncio.sleep(0.5)
        # The renewal that finds it ended is the last call, and names the same request.
        self.assertEqual(len({call.options.request_id for call in self.calls("Jog")}), 1)
        self.assertFalse((await self.feeder.state()).moving)


    async def test_the_block_can_ask_whether_it_was_ended(self):
        with self.assertRaises(axisd.MotionError):
            async with self.feeder.jog(9, hold=0.3) as jog:
                jog.check()
                await self.feeder.stop()
                while True:
                    await asyncio.sleep(0.01)
                    jog.check()


class WholeMachine(ClientTest):
    async def test_wait_online(self):
        self.assertIs((await self.feeder.wait_online()).link, axisd.Link.ONLINE)
        ghost = asyncio.create_task(self.machine.axis("ghost").wait_online())
        await asyncio.sleep(0.3)
        self.assertFalse(ghost.done())
        self.daemon.power("ghost", True)
        self.addCleanup(self.daemon.power, "ghost", False)
        self.assertIs((await ghost).link, axisd.Link.ONLINE)

    async def test_axes_buses_info(self):
        axes = await self.machine.axes()
        self.assertEqual(list(axes), ["feeder", "turntable", "ghost", "sticky"])
        self.assertTrue(axes["feeder"].simulated)
        self.assertEqual((axes["ghost"].link, axes["ghost"].link_error.node), (axisd.Link.OFFLINE, 9))
        self.assertEqual([bus.open for bus in await self.machine.buses()], [True, True])
        self.between.answers["ListBuses"] = canned.BUSES
        self.assertEqual([bus.open for bus in await self.machine.buses()], [True, False, True])
        network = (await self.machine.buses())[2]
        self.assertEqual((network.kind, network.baud), (axisd.BusKind.CANOPEN, 500000))
        self.assertEqual((network.network.link, network.network.sdo_timeouts, network.network.foreign_nodes),
                         (axisd.NetworkLink.ERROR_PASSIVE, 7, (22, 23)))
        self.assertEqual(network.network.link_helper_error.remedy, "enable axisd-link.socket")
        info = await self.machine.info()
        self.assertEqual(info.machine, "press-1")
        self.assertEqual((info.client, info.identity, info.role, info.axis_roles),
                         (OWN_NAME, OWN_NAME, axisd.Role.MAINTAINER, {"ghost": axisd.Role.OPERATOR}))

    async def test_whom_it_speaks_for(self):
        async with axisd.connect(self.machine.server, speak_for="bert", role="viewer") as other:
            info = await other.info()
            self.assertEqual((info.client, info.role), (f"bert via {OWN_NAME}", axisd.Role.VIEWER))
            await other.axis("feeder").stop()
        with self.assertRaises(ValueError):
            axisd.connect("localhost:1", role="viewer")

    async def test_budgets(self):
        self.assertEqual([budget.bus for budget in await self.machine.budgets()], ["line-a", "line-b"])
        self.between.answers["GetBudget"] = canned.BUDGET
        budget, = await self.machine.budgets()
        self.assertEqual((budget.bus, budget.utilisation, budget.excess), ("line-a", (0.25,), ("too late",)))
        self.assertEqual(budget.stops, (axisd.StopBudget(1, 0.028, None),))
        feeder = budget.axes[0]
        self.assertEqual((feeder.stop_alone.last_frame, feeder.seen_stop_frame, feeder.seen_standstill),
                         (0.028, 0.007, None))

    async def test_watch(self):
        ticks = []
        async for tick in self.machine.watch(["feeder"], period=0.01):
            ticks.append(tick)
            if len(ticks) == 3:
                break
        self.assertEqual([tick.tick - ticks[0].tick for tick in ticks], [0, 1, 2])
        async for state in self.feeder.watch(0.01, fields=["unit"]):
            self.assertEqual((state.axis, state.unit, state.model, state.measured_at), ("feeder", "mm", "", None))
            break
        self.assertEqual(list(self.calls("WatchAxes")[-1].fields.paths), ["unit"])
        async for state in self.feeder.watch(0.01):
            self.assertEqual(state.axis, "feeder")
            break

    async def test_stop_all_and_release(self):
        results = {result.axis: result for result in await self.machine.stop_all()}
        self.assertIs(results["feeder"].command.state, axisd.CommandState.DONE)
        self.assertIs(results["ghost"].command.state, axisd.CommandState.UNKNOWN)
        with self.assertRaises(axisd.RefusedError) as raised:
            await self.feeder.move(1)
        self.assertEqual(raised.exception.reason, "inhibited")
        await self.machine.release_stop_all()
        await self.feeder.move(1)


class Drives(ClientTest):
    async def test_parameters(self):
        drive = self.machine.axis("turntable").drive
        info = await drive.info()
        self.assertEqual((info.model, info.inputs[0].functions[1], {alarm.code: alarm.reset for alarm in info.alarms}[2]),
                         ("ykd2405pr", "home", "by_itself"))
        catalogue = await drive.parameters()
        self.assertEqual((catalogue["current"].default, catalogue["current"].access), (6, "read_write_saved"))
        self.assertIsNone(catalogue["node"].default)
        self.assertEqual(catalogue["microstep"].configured_by, "scale.microstep")
        self.assertEqual(await drive.write(lock_current=0, current=7), {"lock_current": 0, "current": 7})
        self.assertEqual(await drive.read("current"), {"current": 7})
        values = await drive.read()
        self.assertEqual((values["current"], "stop" in values), (7, False))
        with self.assertRaises(axisd.RefusedError) as raised:
            await drive.write(stop=1)
        self.assertEqual((raised.exception.remedy, raised.exception.detail.object), ("use AxisService.Stop", 0x28))

    async def test_memory_needs_the_name_again(self):
        with self.assertRaises(axisd.RefusedError):
            await self.feeder.drive.save(confirm="yes")
        turntable = self.machine.axis("turntable").drive
        await turntable.save(confirm="turntable")
        self.between.answers["RestoreFactory"] = canned.RESTORED
        self.assertIn("9600", await self.feeder.drive.restore_factory(confirm="feeder"))

    async def test_segments(self):
        await self.feeder.disable()
        table = axisd.Segments(positions=(axisd.PositionSegment(1, 50, 24, 0.15),),
                               velocities=(axisd.VelocitySegment(2, 8, 0.1),), absolute=True)
        self.assertEqual(await self.feeder.drive.write_segments(table), table)
        self.assertEqual(await self.feeder.drive.segments(), table)
        await self.feeder.drive.write_segments(axisd.Segments())

    async def test_readdress_and_set_serial(self):
        self.between.answers |= {"Readdress": canned.changed("Readdress", verified=True), "SetSerial": canned.changed("SetSerial")}
        phases = [change.phase async for change in self.feeder.drive.readdress(7, confirm="feeder", verify=60)]
        self.assertEqual(phases, ["written", "waiting", "verified"])
        phases = [change.phase async for change in self.feeder.drive.set_serial(baud=9600, confirm="feeder")]
        self.assertEqual(phases, ["written"])
        self.assertEqual((self.calls("Readdress")[0].node, self.calls("SetSerial")[0].baud), (7, 9600))

    async def test_scan_and_registers(self):
        found = [node async for progress in self.machine.scan("line-a", last_node=2) for node in progress.found]
        self.assertEqual([(node.node, node.model, node.configured_as) for node in found],
                         [(1, "ykd2405pr", "feeder"), (2, "ykd2405pr", "turntable")])
        self.assertEqual((await self.machine.read_registers("line-a", 2, 0, 2))[0], 0x301)
        self.between.calls.clear()
        self.between.answers |= {"Scan": canned.SCAN, "Transact": canned.REGISTERS}
        found = [node async for progress in self.machine.scan("line-a", last_node=9) for node in progress.found]
        self.assertEqual([(node.node, node.model, node.configured_as) for node in found],
                         [(1, "ykd2405pr", "feeder"), (5, "ykd2405pr", ""), (8, "", "")])
        self.assertEqual(await self.machine.read_registers("line-a", 9, 16, 2), [65535, 65534])
        await self.machine.write_registers("line-a", 9, 16, [5])
        self.assertEqual(list(self.calls("Transact")[1].write.values), [5])

    async def test_statistics(self):
        self.assertEqual((await self.machine.bus_statistics())["line-a"].nodes[1].name, "feeder")
        self.between.answers["GetBusStatistics"] = canned.STATISTICS
        buses = await self.machine.bus_statistics()
        line, network = buses["line-a"], buses["can0"]
        self.assertEqual((line.kind, line.utilisation, line.since_start), (axisd.BusKind.MODBUS_RTU, 0.25, 60))
        motion = line.classes["motion"]
        self.assertEqual((motion.sent, motion.raw.dropped_superseded), (10, 2))
        self.assertAlmostEqual(motion.queueing.percentile(0.5), 0.1e-3)
        self.assertAlmostEqual(motion.queueing.percentile(0.99), 0.11e-3)
        self.assertEqual((line.nodes[1].name, line.nodes[1].timeouts), ("feeder", 1))
        self.assertEqual((network.nodes[5].timeouts, network.nodes[5].raw.network.tpdos), (3, 40))

        feeder = line.nodes[1]
        self.assertEqual((feeder.quarantine, feeder.unknown_starts.executed, line.held_back),
                         (axisd.Quarantine(True, 75, 0.25, 4, 1), 2, 3))
        self.assertFalse(network.nodes[5].quarantine.active)

    async def test_statistics_again_and_again(self):
        self.between.answers["WatchBusStatistics"] = canned.WATCHED_STATISTICS
        seen = []
        async for buses in self.machine.watch_bus_statistics("line-a", period=0.5):
            seen.append(buses["line-a"].utilisation)
            if len(seen) == 2:
                break
        self.assertEqual(seen, [0.25, 0.25])
        request = self.calls("WatchBusStatistics")[0]
        self.assertEqual((request.bus, request.period.ToMilliseconds()), ("line-a", 500))

    async def test_trace(self):
        self.between.answers["TraceBus"] = canned.TRACE
        frames = []
        async for frame in self.machine.trace("can0", node=5):
            frames.append(frame)
            if len(frames) == 2:
                break
        self.assertEqual(self.calls("TraceBus")[0].node, 5)
        sent, link = frames
        self.assertEqual((sent.sequence, sent.kind, sent.transaction_class, sent.lost), (7, "sent", "stop", 3))
        self.assertEqual((sent.raw.can.id, sent.data[:3]), (0x605, b"\x40\x41\x60"))
        self.assertEqual((link.kind, link.why, link.lost, link.transaction_class), ("link", "bus_off", 0, ""))

    async def test_flight_records(self):
        written = await self.machine.write_flight_record("line-a")
        self.assertIn(written, [record.name for record in await self.machine.flight_records()])
        self.assertIn("# bus: line-a\n", await self.machine.flight_record(written))
        self.between.answers["ListFlightRecords"] = canned.FLIGHT_RECORDS
        (record,) = await self.machine.flight_records()
        self.assertEqual((record.bus, record.size, record.written_at.year), ("line-a", 77, 2023))

    async def test_objects_and_a_scan_of_a_can_network(self):
        self.between.answers |= {"Scan": canned.CAN_SCAN, "Transact": canned.OBJECT}
        found = [node async for progress in self.machine.scan("can0") for node in progress.found]
        self.assertEqual([(node.node, node.vendor, node.product, node.revision) for node in found],
                         [(5, 0x100, 3, None), (9, None, None, None), (22, None, None, None)])
        self.assertEqual(await self.machine.read_object("can0", 5, 0x6041), b"\x37\x02")
        await self.machine.write_object("can0", 9, 0x6200, 1, b"\x05")
        written = self.calls("Transact")[1]
        self.assertEqual((written.address, written.write_object.data), (0x620001, b"\x05"))

    async def test_devices(self):
        self.between.answers |= {"ListDevices": canned.DEVICES, "WriteDevice": canned.WRITTEN}
        self.assertEqual((await self.machine.devices())["valves"].values, {"pressure": 2.5, "flow": None})
        self.assertEqual(await self.machine.write_device("valves", "pressure", 3.04), 3.0)

    async def test_state_shows_cause_and_drift(self):
        self.between.answers["GetAxis"] = canned.DRIFTED
        state = await self.machine.axis("turntable").state()
        self.assertEqual((state.motion_cause, state.drift, state.eeprom_writes),
                         (axisd.MotionCause.TERMINAL, "X1 has no function", 12))

    async def test_events_go_on_at_their_cursor(self):
        async def first(count, **arguments):
            seen = []
            async for event in self.machine.events(**arguments):
                seen.append(event)
                if len(seen) == count:
                    return seen
        self.between.answers["WatchEvents"] = canned.EVENTS
        kept = await first(4, kept=True)
        self.assertEqual([type(event.content).__name__ for event in kept],
                         ["StateChange", "TerminalEdge", "LinkChange", "ConfigurationDrift"])
        self.assertIs(kept[0].content.cause, axisd.MotionCause.TERMINAL)
        self.assertEqual((kept[1].content.before - kept[1].content.after).total_seconds(), 0.02)
        self.between.answers.clear()
        kept = await first(4, kept=True)
        rest = await first(2, after=kept[1].cursor)
        self.assertEqual([event.sequence for event in rest], [event.sequence for event in kept[2:]])
        waiting = asyncio.create_task(first(1, axes=["feeder"]))
        while len(self.calls("WatchEvents")) < 4:
            await asyncio.sleep(0.01)
        await self.machine.axis("turntable").stop()
        await self.feeder.stop()
        self.assertEqual((await waiting)[0].axis, "feeder")


class Errors(ClientTest):
    async def test_refusal_carries_the_detail(self):
        with self.assertRaises(axisd.RefusedError) as raised:
            await self.feeder.move(500)
        error = raised.exception
        self.assertEqual((error.reason, error.message, error.remedy),
                         ("soft_limit", "target 500 mm is beyond a software limit", "choose a target within the limits"))
        self.assertEqual((error.detail.permitted.minimum, error.detail.permitted.maximum), (0, 400))
        self.assertEqual(str(error), "feeder: target 500 mm is beyond a software limit (permitted 0 to 400 mm); "
                                     "choose a target within the limits")

    async def test_offline_is_a_refusal_and_no_daemon_is_unreachable(self):
        with self.assertRaises(axisd.RefusedError) as raised:
            await self.machine.axis("ghost").enable()
        self.assertEqual(raised.exception.reason, "offline")
        await self.server.stop(0)
        with self.assertRaises(axisd.UnreachableError) as raised:
            await self.feeder.move(1, request_id="abc")
        self.assertEqual(raised.exception.request_id, "abc")

    async def test_watch_translates_errors(self):
        with self.assertRaisesRegex(axisd.RefusedError, "no axis 'nobody'"):
            async for _ in self.machine.axis("nobody").watch():
                self.fail("no state expected")

    def test_an_address_is_what_axisctl_takes(self):
        for given, meant in {"press-1": "press-1:7443", "press-1:8000": "press-1:8000", "::1": "[::1]:7443",
                             "[fe80::1]": "[fe80::1]:7443", "unix:/run/axisd": "unix:/run/axisd",
                             "dns:///press-1": "dns:///press-1"}.items():
            self.assertEqual(axisd.connect(given).server, meant)
        self.assertEqual(axisd.connect("press-1", stop_server="press-1").stop_server, "press-1:7444")
        self.assertIsNone(axisd.connect("press-1").stop_server)
        self.assertEqual(axisd.connect_cell("press-1").server, "press-1:7445")
        for wrong in ("press-1:65536", "press-1:0", "press-1:", "[::1]:70000", "press-1:abc"):
            with self.assertRaises(ValueError):
                axisd.connect(wrong)

    def test_certificates_belong_together(self):
        for given, wrong in (({"tls_key": "x"}, "tls_certificate and tls_key need tls_ca"),
                             ({"tls_ca": "x", "tls_certificate": "x"}, "tls_certificate and tls_key belong together"),
                             ({"tls_ca": "x", "tls_key": "x"}, "tls_certificate and tls_key belong together")):
            for connect in (axisd.connect, axisd.connect_cell):
                with self.assertRaisesRegex(axisd.ArgumentError, wrong):
                    connect("localhost:1", **given)


class Packaging(unittest.TestCase):
    def test_builds_without_network_and_imports(self):
        with tempfile.TemporaryDirectory() as directory:
            # From a copy: setuptools writes beside its sources, and parallel tests share the tree.
            for name in ("api/python", "proto"):
                subprocess.run(["cp", "-r", "--parents", name, directory], cwd=ROOT, check=True)
            source = pathlib.Path(directory) / "api" / "python"
            # --build-lib relative, as pip has it
            subprocess.run([sys.executable, "setup.py", "-q", "build_py", "--build-lib", "built"], check=True,
                           cwd=source, stderr=subprocess.DEVNULL)
            built = source / "built"
            self.assertTrue((built / "axisd" / "py.typed").exists())
            done = subprocess.run([sys.executable, "-c", "import axisd; print(axisd.connect('x:1').server)"],
                                  env=os.environ | {"PYTHONPATH": str(built)}, capture_output=True, text=True,
                                  check=True)
            self.assertEqual(done.stdout.strip(), "x:1")


if __name__ == "__main__":
    signal.alarm(600)  # a hang names itself instead of blocking a test run
    unittest.main()
