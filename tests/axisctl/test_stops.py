"""What clients do about stops whose answer is lost, that are not confirmed, and about names that there are not."""
import socket
import subprocess
import unittest

from between import Passage
from support import AXISCTL, LIMIT, AxisctlTest, PythonTest, environment  # makes axisd importable
import axisd
from axisd.v1 import error_pb2, group_service_pb2 as group_pb, types_pb2

ALWAYS = 1_000_000
OFFLINE = error_pb2.ErrorDetail(reason=error_pb2.REASON_OFFLINE, message="the drive does not answer")
UNCONFIRMED = error_pb2.ErrorDetail(reason=error_pb2.REASON_NOT_CONFIRMED, message="sticky: standstill was not confirmed",
                                    remedy="look at the machine")


class ClientTest(PythonTest):
    def request_ids(self, method):
        return [request.options.request_id for request in self.calls(method)]


class LostAnswers(ClientTest):
    async def test_stops_are_repeated_as_they_are(self):
        for method, stop in (("Halt", self.feeder.halt), ("Stop", self.feeder.stop),
                             ("QuickStop", self.feeder.quick_stop)):
            self.between.losing[method] = 2
            self.assertIs((await stop()).state, axisd.CommandState.DONE)
            self.assertEqual(len(self.request_ids(method)), 3)
            self.assertEqual(len(set(self.request_ids(method))), 1)
            await stop()
            self.assertEqual(len(set(self.request_ids(method))), 2, "another stop is another request")

    async def test_stops_of_several_are_repeated_as_they_are(self):
        self.between.losing.update(GroupStop=2, GroupHalt=2, StopAll=2)
        group = self.machine.group(axes=("feeder", "turntable"))
        self.assertEqual(set(await group.stop(hold=True)), {"feeder", "turntable"})
        self.assertEqual(len(self.calls("GroupStop")), 3)
        self.assertEqual(len({request.request_id for request in self.calls("GroupStop")}), 1)
        await group.halt()
        self.assertEqual(len(self.calls("GroupHalt")), 3)
        await self.machine.stop_all(wait=False)
        self.assertEqual(len(self.calls("StopAll")), 3)

    async def test_a_cancel_is_repeated(self):
        command = await self.feeder.velocity(30)
        self.between.losing["CancelCommand"] = 1
        self.assertIs((await self.machine.cancel(command.id)).state, axisd.CommandState.ABORTED)

    async def test_after_the_time_limit_it_is_told_that_nobody_knows(self):
        self.between.losing.update(Stop=ALWAYS)
        self.machine.timeout = 0.3
        with self.assertRaisesRegex(axisd.UnreachableError, "repeated for 0.3 s: whether it arrived is not known") as raised:
            await self.feeder.stop()
        self.assertFalse(raised.exception.nothing_sent)
        self.assertGreater(len(self.calls("Stop")), 2)

    async def test_nothing_else_is_ever_repeated(self):
        self.between.losing.update(MoveRelative=1, Disable=1, ReleaseStop=1, MoveGroup=1)
        with self.assertRaises(axisd.UnreachableError) as raised:
            await self.feeder.move_relative(5)
        self.assertEqual(self.request_ids("MoveRelative"), [raised.exception.request_id])
        self.assertFalse(raised.exception.nothing_sent)
        self.daemon.hold("turntable", "")
        for call in (self.machine.group("transfer").move({"feeder": 1}), self.machine.axis("turntable").release_stop(),
                     self.feeder.disable()):
            with self.assertRaises(axisd.UnreachableError):
                await call
        for method in ("Disable", "ReleaseStop", "MoveGroup"):
            self.assertEqual(len(self.calls(method)), 1, method)

    async def test_a_refused_stop_is_not_repeated(self):
        with self.assertRaises(axisd.RefusedError):
            await self.machine.axis("nobody").stop()
        self.assertEqual(len(self.calls("Stop")), 1)


class Held(ClientTest):
    async def holds(self, axis="feeder"):
        return (await self.machine.axis(axis).state()).holds

    async def test_a_program_releases_what_it_holds_and_nothing_else(self):
        self.daemon.hold("feeder", "another-program")
        self.daemon.hold("feeder", "")
        await self.feeder.stop(hold=True)
        await self.feeder.quick_stop(hold=True)
        self.assertEqual(len(await self.holds()), 4)
        left = await self.feeder.release_stop()
        self.assertEqual({hold.request_id for hold in left}, {"another-program", ""})
        self.assertEqual(left, await self.holds())
        self.assertGreaterEqual(left[0].since.year, 2023)
        await self.feeder.release_stop()  # holds none itself: the one without a name
        self.assertEqual([hold.request_id for hold in await self.holds()], ["another-program"])

    async def test_a_hold_by_name_is_released_by_name(self):
        await self.feeder.stop(hold=True, request_id="guard-door")
        self.assertEqual([request.options.request_id for request in self.calls("Stop")], ["guard-door"])
        async with axisd.connect(self.machine.server) as other:
            self.assertEqual(await other.axis("feeder").release_stop("guard-door"), ())

    async def test_a_hold_that_somebody_else_released_is_no_error(self):
        await self.feeder.stop(hold=True)
        async with axisd.connect(self.machine.server) as other:
            self.assertEqual(await other.axis("feeder").release_stop(everybody=True), ())
        self.assertEqual(await self.feeder.release_stop(), ())
        with self.assertRaises(axisd.RefusedError):
            await self.feeder.release_stop()

    async def test_a_stop_without_an_answer_is_released_too(self):
        self.between.losing["Stop"] = ALWAYS
        self.machine.timeout = 0.3
        with self.assertRaises(axisd.UnreachableError):
            await self.feeder.stop(hold=True)
        self.assertEqual(len(await self.holds()), 1)
        self.assertEqual(await self.feeder.release_stop(), ())

    async def test_a_program_does_not_fill_its_share(self):
        for _ in range(30):
            await self.feeder.stop(hold=True)
        self.assertEqual(len(await self.holds()), 8)
        self.assertEqual(await self.feeder.release_stop(), ())

    async def test_groups(self):
        self.daemon.hold("turntable", "r")
        group = self.machine.group("transfer")
        await group.stop(hold=True)
        await group.stop(hold=True)
        left = await group.release_stop()
        self.assertEqual((left["feeder"], [hold.request_id for hold in left["turntable"]]), ((), ["r"]))
        await group.stop(hold=True)
        self.assertEqual(await self.feeder.release_stop(), (), "of its axes one by one, too")
        self.assertEqual(len(await self.holds("turntable")), 2)
        await group.release_stop()
        self.assertEqual(len(await self.holds("turntable")), 1)
        with self.assertRaises(axisd.RefusedError):
            await group.release_stop()
        self.assertEqual((await group.stop(hold=True))["feeder"].kind, "stop")
        self.assertEqual(await group.release_stop(everybody=True), {"feeder": (), "turntable": ()})


class NoDaemon(unittest.IsolatedAsyncioTestCase):
    async def test_what_was_never_sent_is_told(self):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            async with axisd.connect(f"127.0.0.1:{free.getsockname()[1]}", timeout=0.3) as machine:
                with self.assertRaisesRegex(axisd.UnreachableError, "nothing was sent") as raised:
                    await machine.axis("feeder").move(1)
                self.assertTrue(raised.exception.nothing_sent)
                with self.assertRaisesRegex(axisd.UnreachableError, "repeated for 0.3 s: it never arrived"):
                    await machine.axis("feeder").stop()


class StopsOfSeveral(ClientTest):
    async def test_each_that_did_not_confirm_is_named_with_its_cause(self):
        group = self.machine.group(axes=("feeder", "ghost", "sticky"))
        for method, stop in (("GroupStop", group.stop), ("GroupHalt", group.halt)):
            self.between.answers[method] = getattr(group_pb, f"{method}Response")(results=[
                {"name": "feeder", "command": {"axis": "feeder", "state": types_pb2.COMMAND_STATE_DONE}},
                {"name": "ghost", "error": OFFLINE},
                {"name": "sticky", "command": {"axis": "sticky", "state": types_pb2.COMMAND_STATE_ERROR, "cause": UNCONFIRMED}}])
            with self.assertRaises(axisd.StopError) as raised:
                await stop()
            self.assertEqual(set(raised.exception.failed), {"ghost", "sticky"})
            self.assertEqual(len(raised.exception.results), 3)
            self.assertIs(raised.exception.failed["sticky"].command.cause.reason, axisd.Reason.NOT_CONFIRMED)
            self.assertIs(raised.exception.failed["ghost"].error.reason, axisd.Reason.OFFLINE)
            self.assertRegex(str(raised.exception), r"2 of 3: ghost: .+ \| sticky: \w+ Error: standstill was not confirmed")

    async def test_without_waiting_it_has_to_be_accepted(self):
        self.assertEqual(set(await self.machine.group(axes=("feeder", "sticky")).stop(wait=False)), {"feeder", "sticky"})
        with self.assertRaises(axisd.StopError) as raised:
            await self.machine.group(axes=("feeder", "nobody")).stop(wait=False)
        self.assertEqual(set(raised.exception.failed), {"nobody"})

    async def test_a_misspelt_member_is_named_and_the_others_are_stopped(self):
        with self.assertRaisesRegex(axisd.StopError, "feedr: there is no axis 'feedr'; list them: axisctl list") as raised:
            await self.machine.group(axes=("feedr", "turntable")).stop()
        self.assertEqual([result.confirmed for result in raised.exception.results], [False, True])

    async def test_a_block_that_ends_by_an_error_tells_that_its_axes_may_move(self):
        self.between.answers["GroupStop"] = group_pb.GroupStopResponse(results=[{"name": "ghost", "error": OFFLINE}])
        with self.assertRaises(axisd.StopError) as raised:
            async with self.machine.group(axes=("feeder", "ghost")):
                raise KeyError("of the program")
        self.between.answers.clear()
        self.assertIsInstance(raised.exception.__cause__, KeyError)
        with self.assertRaises(KeyError):
            async with self.machine.group(axes=("feeder", "turntable")):
                raise KeyError("of the program")


class Names(ClientTest):
    async def test_a_velocity_for_nobody_is_refused(self):
        with self.assertRaisesRegex(axisd.ArgumentError, "'feedr', which has no target; did you mean 'feeder'") as raised:
            await self.machine.group("transfer").move({"feeder": 1}, velocity={"feedr": 5})
        self.assertIsInstance(raised.exception, axisd.RefusedError)
        self.assertIsInstance(raised.exception, ValueError)
        self.assertIs(raised.exception.reason, axisd.Reason.INVALID_ARGUMENT)
        self.assertEqual(self.calls("MoveGroup"), [])

    async def test_who_is_no_member_is_refused(self):
        group = self.machine.group(axes=("feeder", "turntable"))
        with self.assertRaisesRegex(axisd.ArgumentError, "'feedr' is no member; did you mean 'feeder'"):
            await group.move({"feedr": 1})
        self.assertEqual(self.calls("MoveGroup"), [])

    async def test_a_refused_name_is_forgotten(self):
        group = self.machine.group()
        with self.assertRaises(axisd.RefusedError):
            await group.move({"feedr": 1})
        await group.move({"feeder": 1})
        self.assertEqual(set(await group.stop()), {"feeder"})

    async def test_one_name_is_not_taken_for_its_letters(self):
        async for tick in self.machine.watch("feeder"):
            self.assertEqual(set(tick.axes), {"feeder"})
            break
        await self.machine.group(axes="feeder").stop()
        self.assertEqual(list(self.calls("GroupStop")[0].axes), ["feeder"])

    async def test_explain_refuses_what_a_command_does_not_take(self):
        for arguments in ({"command": "home", "value": 5}, {"command": "move", "value": 5, "hold": 1}, {"value": 5},
                          {"command": "jog", "value": 5, "velocity": 5}):
            with self.assertRaises(axisd.ArgumentError, msg=arguments):
                await self.feeder.explain(**arguments)
        with self.assertRaisesRegex(axisd.ArgumentError, "did you mean 'move_relative'"):
            await self.feeder.explain("move_relativ", 5)


class Reasons(ClientTest):
    def test_there_is_one_for_each_of_the_contract(self):
        for kind, descriptor, prefix in ((axisd.Reason, error_pb2.Reason.DESCRIPTOR, "REASON_"),
                                         (axisd.Outcome, error_pb2.Outcome.DESCRIPTOR, "OUTCOME_")):
            self.assertEqual([member.name for member in kind],
                             [value.name.removeprefix(prefix) for value in descriptor.values])
            self.assertEqual([member.value for member in kind], [member.name.lower() for member in kind])

    def test_each_arrives_as_itself(self):
        for value in error_pb2.Reason.DESCRIPTOR.values:
            detail = axisd.ErrorDetail.of(error_pb2.ErrorDetail(reason=value.number))
            self.assertIs(detail.reason, axisd.Reason[value.name.removeprefix("REASON_")])
        self.assertIs(axisd.ErrorDetail.of(error_pb2.ErrorDetail(reason=9999)).reason, axisd.Reason.UNSPECIFIED)

    async def test_errors_carry_it(self):
        with self.assertRaises(axisd.RefusedError) as raised:
            await self.feeder.move(9000)
        self.assertIs(raised.exception.reason, axisd.Reason.SOFT_LIMIT)
        self.assertEqual(raised.exception.reason, "soft_limit")


class CommandLine(AxisctlTest):
    def ids(self, method):
        return [request.options.request_id for request in self.server.calls(method)]

    def test_stops_are_repeated_as_they_are(self):
        for method, word in (("Halt", "halt"), ("Stop", "stop"), ("QuickStop", "quick-stop")):
            self.server.losing[method] = 2
            self.ok(word, "feeder", "turntable")
            self.assertEqual(len(self.ids(method)), 4)
            self.assertEqual(len(set(self.ids(method))), 2)
        self.server.losing.update(Stop=2)
        self.ok("stop", "feeder", "--hold")
        self.assertEqual(len(self.daemon.client.state("feeder").holds), 1, "repetitions are one hold")
        self.server.losing.update(GroupStop=2, StopAll=2)
        self.ok("group", "stop", "transfer", "--hold")
        self.assertEqual(len({request.request_id for request in self.server.calls("GroupStop")}), 1)
        self.assertIn("released", self.ok("release-stop", "--all"))
        self.ok("stop", "--all")
        self.assertEqual(len(self.server.calls("StopAll")), 3)

    def test_each_axis_is_told_of(self):
        self.server.losing["Stop"] = ALWAYS
        done = self.run_axisctl("--timeout", "300ms", "stop", "feeder", "nobody", "turntable")
        self.assertEqual(done.returncode, 3)
        self.assertRegex(done.stderr, "feeder.*repeated for 300 ms: whether it arrived is not known")
        self.assertRegex(done.stderr, "turntable.*whether it arrived is not known")

    def test_without_a_daemon_it_says_that_nothing_was_sent(self):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            server = f"127.0.0.1:{free.getsockname()[1]}"
            self.assertRegex(self.fails(3, "--timeout", "300ms", "stop", "feeder", server=server), "it never arrived")
            self.assertNotIn("--request-id", self.fails(3, "enable", "feeder", server=server))

    def test_a_stop_reaches_a_daemon_that_is_being_restarted(self):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            address = f"127.0.0.1:{free.getsockname()[1]}"
        stop = subprocess.Popen([AXISCTL, "--server", address, "--timeout", "60s", "stop", "feeder"],
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment())
        self.addCleanup(stop.kill)
        with self.assertRaises(subprocess.TimeoutExpired):
            stop.wait(1)  # it has failed to connect by then, and goes on
        with Passage(self.daemon.server, address) as server:
            printed, errors = stop.communicate(timeout=LIMIT)
            self.assertEqual((stop.returncode, errors), (0, ""), printed)
            self.assertEqual(len(server.calls("Stop")), 1)

    def test_motion_is_not_repeated(self):
        self.server.losing["MoveAbsolute"] = 1
        self.assertIn("--request-id ", self.fails(3, "move", "feeder", "5mm"))
        self.assertEqual(len(self.server.calls("MoveAbsolute")), 1)

    def test_no_axis_is_enabled_unless_all_are_known(self):
        self.fails(4, "enable", "turntable", "nobody")
        self.assertEqual(self.server.calls("Enable"), [])

    def test_what_was_accepted_is_told_where_another_one_is_refused(self):
        done = self.run_axisctl("enable", "turntable", "ghost")
        self.assertEqual(done.returncode, 4)
        self.assertIn("turntable", done.stdout)
        self.assertIn("ghost", done.stderr)

    def test_disable_leaves_nobody_out(self):
        done = self.run_axisctl("disable", "nobody", "feeder")
        self.assertEqual(done.returncode, 4)
        self.assertIn("nobody", done.stderr)
        self.assertEqual(self.server.calls("GetAxis"), [])
        self.assertEqual([request.axis for request in self.server.calls("Disable")], ["nobody", "feeder"])

    def test_a_velocity_that_is_left_out_is_no_velocity(self):
        self.assertIn("velocity", self.fails(2, "group", "move", "transfer", "feeder=5@"))

    def test_a_misspelt_command_is_named(self):
        self.assertIn("there is no option '--velocty'; did you mean '--velocity'?",
                      self.fails(2, "move", "feeder", "5mm", "--velocty", "5mm/s"))
        self.assertIn("'--wait' stands behind '--', where it is a value; give it before that",
                      self.fails(2, "move", "feeder", "--relative", "--", "-5", "--wait"))
        self.assertIn("there is no command 'mov'; did you mean 'move'?", self.fails(2, "mov", "feeder", "5mm"))
        self.assertIn("there is no command 'stpo'; did you mean 'stop'?", self.fails(2, "group", "stpo", "transfer"))
        self.assertIn("AXIS is required", self.fails(2, "halt"))
        self.assertIn("name an axis, or use --all", self.fails(2, "stop"))

    def test_explain_refuses_what_a_command_does_not_take(self):
        for words in (("home", "5mm"), ("move", "5mm", "--hold", "1s"), ("jog", "5mm/s", "--velocity", "1mm/s"),
                      ("enable", "--relative")):
            self.assertIn("takes no", self.fails(2, "explain", "feeder", *words))

    def test_a_hint_about_units(self):
        self.assertNotIn("12", self.fails(2, "move", "feeder", "12kg").partition(";")[2])
        self.assertIn("write it in mm/s, cm/s,", self.fails(2, "move", "feeder", "5mm", "--velocity", "30rpm"))
        self.assertIn("write 120 min", self.fails(2, "lease", "acquire", "feeder", "--ttl", "2h"))


if __name__ == "__main__":
    unittest.main()
