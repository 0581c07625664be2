"""The configuration is changed while the daemon runs: all of it or nothing, and only what changed is touched."""
import asyncio
import json
import pathlib
import signal
import unittest

import grpc

from harness import ENABLE, START, CallFailed, Scenario, axis_pb, feeder, lease_pb, pb, system_pb, wait_for
from harness.client import event_pb
import axisd  # noqa: E402  (made by the harness)


class Reload(Scenario):
    def cell(self, **axes):
        return self.machine(axes or {"feeder": feeder(), "pusher": feeder(node=2)}).start()

    def edit(self, machine, before, after):
        """In the daemon's file, where it stands last."""
        text = pathlib.Path(machine.config).read_text()
        head, found, tail = text.rpartition(before)
        self.assertTrue(found, before)
        pathlib.Path(machine.config).write_text(head + after + tail)

    def reload(self, machine, *options):
        return machine.axisctl("config", "reload", *options)

    def answer(self, machine, dry_run=False, client=None):
        client = client or machine.client
        return client.call(client.system.ReloadConfig, system_pb.ReloadConfigRequest(dry_run=dry_run))

    def served(self, machine):
        return machine.client.call(machine.client.system.GetConfig, system_pb.GetConfigRequest())

    def events(self, machine):
        """Those of the configuration up to now."""
        request = event_pb.WatchEventsRequest(after_sequence=0, kinds=[event_pb.EVENT_KIND_CONFIGURATION_RELOADED])
        stream = machine.client.event.WatchEvents(request)
        try:
            return [event.configuration_reloaded for event in next(stream).events]
        finally:
            stream.cancel()

    def test_changes_an_axis_while_another_moves(self):
        machine = self.cell()
        client = machine.client
        for axis in ("feeder", "pusher"):
            client.to_done("Enable", axis)
            client.to_done("SetPosition", axis, position=0.0)
        client.to_done("MoveAbsolute", "pusher", position=12.0)
        move = client.motion("MoveAbsolute", "feeder", position=300.0, velocity=60.0)
        client.wait_state("feeder", lambda s: s.position > 5, "feeder moves")
        sent = [len(machine.wire.writes(register, node=2)) for register in (START, ENABLE)]
        self.edit(machine, "velocity: 100 mm/s", "velocity: 40 mm/s")
        asked = self.reload(machine, "--dry-run")
        self.assertEqual((asked.returncode, asked.stderr), (0, ""))
        self.assertEqual(asked.stdout.splitlines(), ["axes.pusher changed (limits.velocity)", "could be reloaded now"])
        self.assertIn("config reload", machine.axisctl("config", "show").stderr)
        done = self.reload(machine)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(done.stdout.splitlines(), ["axes.pusher changed (limits.velocity)", "reloaded"])
        client.wait_online("pusher")
        state = client.state("pusher")
        self.assert_state(state, "STANDSTILL")
        self.assertFalse(state.enabled_by_daemon)
        self.assertEqual((pb.PositionTrust.Name(state.trust), state.position),
                         ("POSITION_TRUST_RESTORED", 12.0))
        self.refused("OUT_OF_RANGE", "OUT_OF_RANGE", client.motion, "MoveAbsolute", "pusher",
                     position=20.0, velocity=60.0)
        self.assert_command(client.wait_ended(move), "DONE")
        self.assertEqual(len(machine.wire.writes(START, node=1)), 1)
        self.assertEqual([len(machine.wire.writes(register, node=2)) for register in (START, ENABLE)], sent)
        client.to_done("MoveAbsolute", "pusher", position=20.0)
        text = pathlib.Path(machine.config).read_text()
        self.assertEqual(machine.axisctl("config", "show").stdout, text)
        self.assertEqual(pathlib.Path(machine.state_directory, "last-good.yaml").read_text(), text)

    def test_a_file_with_errors_changes_nothing(self):
        machine = self.cell()
        before = self.served(machine)
        self.edit(machine, "model: ykd2405pr", "model: ykd2405")
        broken = self.reload(machine)
        self.assertEqual(broken.returncode, 2)
        self.assertRegex(broken.stderr, rf"^{machine.config}:\d+:\d+: .*ykd2405.*ykd2405pr")
        self.assertEqual(broken.stdout, "not reloaded: nothing was changed\n")
        pathlib.Path(machine.config).unlink()
        missing = self.answer(machine)
        self.assertFalse(missing.applied)
        self.assertEqual(len(missing.findings), 1)
        self.assertIn("cannot be read", missing.findings[0].message)
        now = self.served(machine)
        self.assertEqual((now.yaml, now.revision, now.file_revision), (before.yaml, before.revision, ""))
        self.assertTrue(machine.daemon.running())
        self.assertEqual(self.events(machine), [])
        self.assert_state(machine.client.state("feeder"), "DISABLED")

    def test_warns_of_what_the_line_cannot_do(self):
        machine = self.cell()
        self.edit(machine, "    node: 2\n", "    node: 2\n    poll: { moving: 5 ms, idle: 5 ms }\n")
        judged = machine.axisctl("config", "check", machine.config)
        self.assertEqual(judged.returncode, 0, judged.stderr)
        self.assertRegex(judged.stderr, rf"^{machine.config}: warning: line: reading everything .* raise poll.idle")
        reloaded = self.reload(machine)
        self.assertEqual((reloaded.returncode, reloaded.stderr), (0, judged.stderr))
        wait_for(lambda: "line: reading everything" in machine.daemon.log(), "the warning is in the log")
        self.edit(machine, "    poll: { moving: 5 ms, idle: 5 ms }\n", "")
        self.assertEqual(list(self.answer(machine).warnings), [])

    def test_refuses_to_change_what_moves_and_says_all_that_is_in_the_way(self):
        machine = self.ready_feeder()
        move = self.move_under_way(machine)
        text = pathlib.Path(machine.config).read_text()
        self.edit(machine, "velocity: 100 mm/s", "velocity: 40 mm/s")
        self.edit(machine, "machine: e2e", "machine: another")
        refused = self.reload(machine)
        self.assertEqual(refused.returncode, 4)
        self.assertRegex(refused.stderr, r"refused: machine changed: .*restart the service")
        self.assertRegex(refused.stderr, r"refused: feeder: executes move_absolute .*axisctl stop feeder")
        self.assertIn("not reloaded: nothing was changed", refused.stdout)
        machine.daemon.process.send_signal(signal.SIGHUP)
        wait_for(lambda: "SIGHUP: not reloaded" in machine.daemon.log(), "SIGHUP is answered in the log")
        self.assertEqual(self.served(machine).yaml, text)
        self.assert_command(machine.client.wait_ended(move), "DONE")
        self.edit(machine, "machine: another", "machine: e2e")
        self.assertTrue(self.answer(machine).applied)

    def test_a_signal_reloads_as_well(self):
        machine = self.cell()
        before = self.served(machine)
        self.edit(machine, "velocity: 100 mm/s", "velocity: 40 mm/s")
        machine.daemon.process.send_signal(signal.SIGHUP)
        wait_for(lambda: self.served(machine).revision != before.revision, "SIGHUP reloads")
        (event,) = self.events(machine)
        now = self.served(machine)
        self.assertEqual((event.client, event.previous_revision, event.revision),
                         ("SIGHUP", before.revision, now.revision))
        self.assertEqual([(c.section, c.name, list(c.keys)) for c in event.changes],
                         [("axes", "pusher", ["limits.velocity"])])
        self.assertEqual(now.revision, now.file_revision)
        self.assertGreater(now.served_since.ToNanoseconds(), before.served_since.ToNanoseconds())
        # Comments change what is shown, and nothing else.
        machine.client.to_done("Enable", "feeder")
        self.edit(machine, "machine: e2e", "# ours\nmachine: e2e")
        cosmetic = self.reload(machine)
        self.assertEqual(cosmetic.stdout.splitlines(), ["only how it is written has changed", "reloaded"])
        self.assertTrue(machine.client.state("feeder").enabled_by_daemon)
        self.assertEqual(self.reload(machine).stdout.splitlines(), ["nothing has changed", "reloaded"])
        self.assertEqual([len(event.changes) for event in self.events(machine)], [1, 0])

    def test_axes_come_and_go_and_streams_tell(self):
        machine = self.machine({"feeder": feeder(), "pusher": feeder(node=2)})
        machine.start_lines()
        both = pathlib.Path(machine.config).read_text()
        one = both[:both.index("  pusher:")]
        pathlib.Path(machine.config).write_text(one)
        machine.start_daemon()
        client = machine.client
        client.wait_online("feeder")
        every = client.axis.WatchAxes(axis_pb.WatchAxesRequest(period={"nanos": 20_000_000}), timeout=60)
        seen = ([state.axis for state in batch.axes] for batch in every)
        self.assertEqual(next(seen), ["feeder"])
        pathlib.Path(machine.config).write_text(both + "groups:\n  both: { axes: [feeder, pusher] }\n")
        self.assertEqual(self.reload(machine).stdout.splitlines(),
                         ["axes.pusher added", "groups.both added", "reloaded"])
        wait_for(lambda: next(seen) == ["feeder", "pusher"], "the new axis appears")
        client.wait_online("pusher")
        client.to_done("Enable", "pusher")
        named = client.axis.WatchAxes(axis_pb.WatchAxesRequest(axes=["pusher"]), timeout=60)
        self.assertEqual([state.axis for state in next(named).axes], ["pusher"])
        pathlib.Path(machine.config).write_text(one)
        energised = self.answer(machine)
        self.assertFalse(energised.applied)
        self.assertEqual([(each.message, each.remedy) for each in energised.refusals],
                         [("pusher: its power stage is on", "disable it first: axisctl disable pusher")])
        client.to_done("Disable", "pusher")
        gone = self.answer(machine)
        self.assertTrue(gone.applied, gone)
        wait_for(lambda: next(seen) == ["feeder"], "the removed axis disappears")
        with self.assertRaises(grpc.RpcError) as ended:
            while True:
                next(named)
        self.assertEqual(CallFailed(ended.exception).reason, "REASON_UNKNOWN_AXIS")
        self.refused("NOT_FOUND", "UNKNOWN_AXIS", client.state, "pusher")
        every.cancel()

    def test_a_leased_axis_is_changed_by_its_holder_only(self):
        machine = self.cell()
        client = machine.client
        grant = client.call(client.lease.AcquireLease, lease_pb.AcquireLeaseRequest(axes=["pusher"], ttl={"seconds": 30}))
        self.edit(machine, "velocity: 100 mm/s", "velocity: 40 mm/s")
        machine.daemon.process.send_signal(signal.SIGHUP)
        wait_for(lambda: "pusher: leased by" in machine.daemon.log(), "SIGHUP is refused")
        self.assertTrue(self.answer(machine).applied)
        client.wait_online("pusher")
        client.motion("Enable", "pusher", wait=pb.WAIT_UNTIL_DONE, options={"lease_token": grant.lease_token})

    def test_the_python_client_reloads_and_hears_of_it(self):
        machine = self.cell()

        async def use():
            async with axisd.connect(f"unix:{machine.socket}") as connection:
                text = pathlib.Path(machine.config).read_text()
                busy = await connection.check_configuration(text.replace("    node: 2\n", "    node: 2\n    poll: { moving: 5 ms, idle: 5 ms }\n"))
                self.assertEqual((busy.findings, len(busy.warnings)), ((), 1), busy)
                wrong = await connection.check_configuration(text.replace("velocity:", "velocty:"))
                self.assertIn("did you mean 'velocity'", str(wrong.findings))
                asked = await connection.reload_configuration(dry_run=True)
                done = await connection.reload_configuration()
                configuration = await connection.configuration()
                async for event in connection.events(kept=True):
                    if isinstance(event.content, axisd.ConfigurationReloaded):
                        return asked, done, configuration, event.content

        self.edit(machine, "velocity: 100 mm/s", "velocity: 40 mm/s")
        asked, done, configuration, event = asyncio.run(use())
        self.assertEqual((asked.applied, done.applied), (False, True))
        self.assertEqual([str(change) for change in asked.changes], ["axes.pusher changed (limits.velocity)"])
        self.assertEqual((asked.changes, done.changes), (event.changes, event.changes))
        self.assertEqual((configuration.revision, configuration.file_revision), (done.revision, event.revision))

    def test_simulated_drives_follow(self):
        machine = self.machine({"feeder": feeder()})
        text = pathlib.Path(machine.config).read_text()
        line = "port: sim"
        text = text.replace(f"port: {machine.path('line')}", line)
        pathlib.Path(machine.config).write_text(text)
        machine.start_daemon()
        client = machine.client
        client.wait_online("feeder")
        pathlib.Path(machine.config).write_text(text + "  lifter:\n" + feeder(node=7).yaml())
        answer = json.loads(machine.axisctl("--json", "config", "reload").stdout)
        self.assertTrue(answer["applied"])
        client.wait_online("lifter")
        client.to_done("Enable", "lifter")
        client.to_done("Disable", "lifter")
        pathlib.Path(machine.config).write_text(text + "  lifter:\n" + feeder(node=8).yaml())
        self.assertTrue(self.answer(machine).applied)
        client.wait_online("lifter")
        self.assertEqual(client.state("lifter").node, 8)


if __name__ == "__main__":
    unittest.main()
