"""The daemon is killed between any two steps of a relative move, and the client repeats its call: what really moved
is compared with what is told."""
import asyncio
import pathlib
import resource
import signal
import time
import unittest

from harness import BLOCK, DONE, START, STOP, CallFailed, Scenario, error_pb, pb, wait_for

DISTANCE, PULSES = 10.0, 20000
NOT_EXECUTED = error_pb.OUTCOME_NOT_EXECUTED


class CrashScenario(Scenario):
    def ready(self, **keys):
        machine = self.ready_feeder(**keys)
        self.before = machine.sim.shaft()
        return machine

    def journal(self, machine):
        return (pathlib.Path(machine.state_directory) / "journal.v1").read_text()

    def wait_frame(self, machine, address, value=None, function=None):
        """Until the drive was sent this, whether it heard it or not."""
        def seen():
            return [frame for frame in machine.wire.requests(since=self.since) if frame.address == address
                    and (function in (None, frame.function)) and (value is None or frame.writes(address, value))]
        return wait_for(seen, f"a frame for {address:#06x}")

    def move(self, machine, request_id="once"):
        self.since = time.monotonic_ns()
        return machine.client.motion("MoveRelative", "feeder", request_id=request_id, distance=DISTANCE)

    def retry(self, machine, request_id="once"):
        """Repeats the call until it is answered; its command, which has ended."""
        def answered():
            try:
                return machine.client.motion("MoveRelative", "feeder", wait=DONE, request_id=request_id,
                                             distance=DISTANCE)
            except CallFailed as failure:
                self.assertIn(failure.reason, ("REASON_CONFIGURING", "REASON_OFFLINE"), failure)
                return None
        return wait_for(answered, "an answer to the repeated call")

    def restart_and_judge(self, machine, killed=True):
        """Kills the daemon, starts it again and repeats the call: the truth is 0 or 1 moves, and what is told is true."""
        if killed:
            machine.daemon.kill()
        machine.sim.control("fault clear")
        machine.start_daemon()
        command = self.retry(machine)
        machine.sim.wait_rest()
        shaft = machine.sim.shaft()
        moved, starts = shaft.position - self.before.position, shaft.starts - self.before.starts
        told = f"{command}\nmoved {moved} pulses, {starts} start(s)"
        self.assertLessEqual(starts, 1, told)
        if command.state == pb.COMMAND_STATE_DONE:
            self.assertEqual((moved, starts), (PULSES, 1), told)
        else:
            self.assert_command(command, "ABORTED")
            self.assertTrue(command.cause.message and command.cause.remedy, told)
            if command.cause.outcome == NOT_EXECUTED:
                self.assertEqual(moved, 0, told)
            else:
                self.assertEqual(starts, 1, told)
                self.assertTrue(0 < moved < PULSES, told)
        # However often it is repeated.
        again = self.retry(machine)
        self.assertEqual((again.id, again.state), (command.id, command.state))
        self.assertEqual(machine.sim.shaft(), shaft)
        return command

    def assert_not_executed(self, command):
        self.assert_command(command, "ABORTED")
        self.assertEqual(command.cause.outcome, NOT_EXECUTED, command)


class KilledBetweenSteps(CrashScenario):
    def killed_at(self, fault, address, value=None, function=None):
        """The daemon waits for a reply that does not come when it is killed."""
        machine = self.ready()
        machine.sim.control(f"fault {fault} node=1 register={address:#06x}")
        self.move(machine)
        self.wait_frame(machine, address, value, function)
        return self.restart_and_judge(machine)

    def test_before_it_was_accepted(self):
        machine = self.ready()
        machine.daemon.kill()
        machine.start_daemon()
        self.assert_command(self.retry(machine), "DONE")
        self.assertEqual(machine.sim.shaft().position - self.before.position, PULSES)

    def test_once_it_is_accepted(self):
        machine = self.ready()
        self.move(machine)
        self.restart_and_judge(machine)

    def test_once_it_is_durable(self):
        machine = self.ready()
        self.move(machine)
        wait_for(lambda: " sending " in self.journal(machine).split("kind=move_relative")[-1] or
                 "sending id" in self.journal(machine).split("accepted")[-1], "the journal knows of it")
        self.restart_and_judge(machine)

    def test_canary_is_asked_for(self):
        self.assert_not_executed(self.killed_at("drop_request count=-1 function=3", BLOCK, function=3))

    def test_canary_was_read(self):
        self.assert_not_executed(self.killed_at("drop_request count=-1 function=16", BLOCK, function=16))

    def test_block_was_written_but_not_acknowledged(self):
        self.assert_not_executed(self.killed_at("drop_reply count=-1 function=16", BLOCK, function=16))

    def test_trigger_never_arrived(self):
        self.assert_not_executed(self.killed_at("drop_request count=-1 function=6", START))

    def test_trigger_was_executed_but_not_acknowledged(self):
        command = self.killed_at("drop_reply count=-1 function=6", START)
        self.assertNotEqual(command.cause.outcome, NOT_EXECUTED, command)

    def test_it_moves(self):
        machine = self.ready()
        self.move(machine)
        machine.sim.wait_moving()
        wait_for(lambda: machine.sim.shaft().position - self.before.position > 2000, "it is on its way")
        command = self.restart_and_judge(machine)
        self.assertNotEqual(command.cause.outcome, NOT_EXECUTED, command)
        self.assertTrue(machine.wire.writes(STOP, 0, since=self.since))

    def test_it_arrived_but_the_daemon_has_not_seen_it(self):
        machine = self.ready()
        self.move(machine)
        machine.sim.wait_moving()
        machine.daemon.process.send_signal(signal.SIGSTOP)
        machine.sim.wait_rest()
        self.assertEqual(machine.sim.shaft().position - self.before.position, PULSES)
        self.assert_command(self.restart_and_judge(machine), "DONE")

    def test_it_is_done(self):
        machine = self.ready()
        command = machine.client.wait_ended(self.move(machine))
        self.assert_command(command, "DONE")
        told = self.restart_and_judge(machine)
        self.assert_command(told, "DONE")
        self.assertEqual(told.id, command.id)
        self.assertEqual(machine.client.get_command(command), told)

    def test_the_drive_cannot_be_read(self):
        machine = self.ready()
        self.move(machine)
        machine.sim.wait_moving()
        machine.daemon.kill()
        machine.sim.control("power 1 off")
        machine.start_daemon()
        command = self.retry(machine)
        self.assert_command(command, "UNKNOWN")
        machine.sim.control("power 1 on")
        # A stop comes first, and the axis stays as it is until somebody has looked at it, over restarts too.
        for _ in range(2):
            state = machine.client.wait_online("feeder")
            self.assert_state(state, "ERROR_STOP")
            self.assertEqual(self.retry(machine).id, command.id)
            machine.daemon.kill()
            restarted = time.monotonic_ns()
            machine.start_daemon()
        machine.client.wait_online("feeder")
        self.assertTrue(machine.wire.writes(since=restarted)[0].writes(STOP, 0))
        machine.client.to_done("Reset", "feeder")
        machine.client.to_done("Enable", "feeder")


class KilledAtAnyTime(CrashScenario):
    def test_within_one_move(self):
        for delay_ms in (0, 1, 2, 4, 7, 11, 16, 25, 60, 150, 300):
            with self.subTest(delay_ms=delay_ms):
                machine = self.ready()
                self.move(machine)
                time.sleep(delay_ms / 1000)
                self.restart_and_judge(machine)


class FullDisk(CrashScenario):
    """The limit of a file's size stands for a full disk."""

    def limit(self, machine, size):
        resource.prlimit(machine.daemon.process.pid, resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))

    def test_refuses_what_is_new_and_nothing_else(self):
        machine = self.ready()
        command = machine.client.motion("MoveAbsolute", "feeder", position=300.0)
        machine.sim.wait_moving()
        self.limit(machine, 0)
        machine.client.to_done("Stop", "feeder")
        self.assert_command(machine.client.wait_ended(command), "ABORTED")
        starts = machine.sim.shaft().starts

        def refused():
            try:
                ended = machine.client.motion("MoveRelative", "feeder", wait=DONE, distance=1.0)
            except CallFailed as failure:
                return failure
            self.assert_command(ended, "ERROR")
            self.assertEqual(ended.cause.reason, error_pb.REASON_STORAGE, ended)
            return None
        failure = wait_for(refused, "the trouble is known")
        self.assertEqual(failure.reason, "REASON_STORAGE", failure)
        self.assertIn("journal.v1", failure.detail.message)
        self.assertTrue(failure.detail.remedy)
        self.assertEqual(machine.sim.shaft().starts, starts)
        for name in ("Halt", "Stop", "Disable"):
            machine.client.to_done(name, "feeder")
        self.assertFalse(machine.client.state("feeder").enabled)
        # There is space again: nobody has to do anything.
        self.limit(machine, resource.RLIM_INFINITY)

        def enabled():
            try:
                return machine.client.to_done("Enable", "feeder")
            except CallFailed as still:
                self.assertEqual(still.reason, "REASON_STORAGE", still)
                return None
        wait_for(enabled, "new commands are accepted again")


class Damage(CrashScenario):
    def test_is_remembered(self):
        machine = self.ready()
        self.assert_command(machine.client.wait_ended(self.move(machine)), "DONE")
        machine.daemon.terminate()
        file = pathlib.Path(machine.state_directory) / "journal.v1"
        text = file.read_bytes()
        at = text.index(b"request=once")
        file.write_bytes(text[:at] + b"X" + text[at + 1:])
        for accepted in range(2):
            machine.start_daemon()
            machine.client.wait_online("feeder")
            # Somebody has to look at it, and that alone does not make the request new.
            for reason in (("FAILED_PRECONDITION", "STATE_UNACCEPTED"), ("UNAVAILABLE", "STORAGE"))[accepted:]:
                detail = self.refused(*reason, machine.client.motion, "MoveRelative", "feeder", request_id="once",
                                      distance=DISTANCE)
                self.assertIn("damaged", detail.message)
                self.assertIn("ask again in ", detail.remedy)
                self.assertEqual(detail.outcome, error_pb.OUTCOME_UNKNOWN)
                self.assertEqual(machine.axisctl("state", "accept").returncode, 0)
            self.assertIn("the command journal was damaged", machine.daemon.log())
            machine.client.to_done("Stop", "feeder")
            machine.daemon.terminate()
        self.assertEqual(machine.sim.shaft().starts - self.before.starts, 1)


class TornJournal(CrashScenario):
    def test_a_last_line_that_was_never_durable_keeps_nobody_from_moving(self):
        """What a crash of the computer may leave of a line behind the last one that was synced."""
        machine = self.ready()
        self.assert_command(machine.client.wait_ended(self.move(machine)), "DONE")
        file = pathlib.Path(machine.state_directory) / "journal.v1"
        for number, torn in enumerate((b"1", b"1c291ca3 9 acce", b"\0" * 300, "cut", "all but its end")):
            machine.daemon.kill()
            text = file.read_bytes()
            last = text.splitlines()[-1]
            left = {"cut": last[:len(last) // 2], "all but its end": last[:-1]}.get(torn, torn)
            file.write_bytes(text + left)
            machine.start_daemon()
            machine.client.wait_online("feeder")
            self.assertIn(f"ends in {len(left)} bytes of a line that a crash cut short", machine.daemon.log())
            self.assertEqual(self.retry(machine).state, pb.COMMAND_STATE_DONE)
            machine.client.to_done("Enable", "feeder")
            machine.client.to_done("MoveRelative", "feeder", distance=1.0, request_id=f"after-{number}")


class RepeatedByAxisctl(CrashScenario):
    def test_moves_once(self):
        machine = self.ready()
        words = ("move", "feeder", "10mm", "--relative", "--request-id", "shift-7", "--wait")
        first = machine.axisctl(*words)
        self.assertEqual(first.returncode, 0, first)
        machine.daemon.kill()
        machine.start_daemon()
        machine.client.wait_online("feeder")
        again = machine.axisctl(*words)
        self.assertEqual(again.returncode, 0, again)
        self.assertEqual(machine.sim.shaft().position - self.before.position, PULSES)


class RepeatedByPython(CrashScenario):
    def test_as_its_documentation_says(self):
        import axisd  # the package that the harness has built
        machine = self.ready()

        async def repeat_until_answered():
            while True:
                try:
                    async with axisd.connect(f"unix:{machine.socket}") as connection:
                        return await connection.axis("feeder").move_relative(
                            DISTANCE, velocity=2, request_id="py-1")
                except axisd.UnreachableError as error:
                    self.assertEqual(error.request_id, "py-1")
                    await asyncio.sleep(0.05)

        async def scenario():
            call = asyncio.create_task(repeat_until_answered())
            await asyncio.to_thread(machine.sim.wait_moving)
            await asyncio.to_thread(machine.daemon.kill)
            await asyncio.to_thread(machine.start_daemon)
            with self.assertRaises(axisd.MotionError) as caught:
                await call
            return caught.exception.command
        command = asyncio.run(scenario())
        self.assertEqual((command.state.name, command.cause.outcome), ("ABORTED", "unknown"), command)
        self.assertIn("in part", command.cause.message)
        self.assertEqual(machine.sim.shaft().starts - self.before.starts, 1)


if __name__ == "__main__":
    unittest.main()
