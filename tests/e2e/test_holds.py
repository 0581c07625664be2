"""Everybody's stop counts: several programs hold an axis, the daemon ends and starts in between."""
import asyncio
import pathlib
import re
import unittest

from certificates import Certificates
from harness import OWN_NAME, Scenario, axis_pb, feeder, wait_for
from harness.client import event_pb
import axisd  # noqa: E402  (made by the harness)


class Holds(Scenario):
    def programs(self, machine, what, server=None):
        """Runs `what` with two programs: connections of the Python client of their own."""
        async def run():
            target = server or f"unix:{machine.socket}"
            async with axisd.connect(target) as first, axisd.connect(target) as second:
                return await what(first.axis("feeder"), second.axis("feeder"))
        return asyncio.run(run())

    def refused_move(self, machine, *texts):
        for name, fields in (("MoveAbsolute", {"position": 5.0}), ("Enable", {}), ("Jog", {"velocity": 1.0})):
            detail = self.refused("FAILED_PRECONDITION", "STOPPING", machine.client.motion, name, "feeder", **fields)
            for text in texts:
                self.assertIn(text, detail.message)
            self.assertIn("axisctl release-stop feeder", detail.remedy)

    def events(self, machine):
        request = event_pb.WatchEventsRequest(after_sequence=0, kinds=[event_pb.EVENT_KIND_STOP_HOLD_CHANGE])
        stream = machine.client.event.WatchEvents(request)
        try:
            return [event.stop_hold_change for event in next(stream).events]
        finally:
            stream.cancel()

    def test_of_two_programs_both_have_to_release(self):
        machine = self.ready_feeder()
        self.move_under_way(machine)

        async def hold(first, second):
            await asyncio.gather(first.stop(hold=True), second.stop(hold=True))
            state = await first.state()
            self.assertIs(state.state, axisd.State.STOPPING)
            self.assertEqual([hold.holder for hold in state.holds], [OWN_NAME] * 2)
            self.assertTrue(all(hold.durable for hold in state.holds))
            left = await first.release_stop()
            self.assertEqual(len(left), 1)
            with self.assertRaisesRegex(axisd.RefusedError, left[0].request_id) as refused:
                await first.move(5)
            self.assertIs(refused.exception.reason, axisd.Reason.STOPPING)
            self.assertIn(left[0].request_id, (await first.explain())[0].message)
            self.assertEqual(await second.release_stop(), ())
            await first.move(5)
        self.programs(machine, hold)
        self.assertEqual([event_pb.StopHoldChangeKind.Name(event.kind)[22:] for event in self.events(machine)],
                         ["HELD", "HELD", "RELEASED", "RELEASED"])

    def held_over(self, end):
        """`end`s the daemon while two programs hold."""
        machine = self.ready_feeder()
        self.move_under_way(machine)
        ids = []

        async def hold(first, second):
            await first.stop(hold=True)
            await second.stop(hold=True, request_id="guard-door")
            ids.extend(hold.request_id for hold in (await first.state()).holds if hold.request_id != "guard-door")
        self.programs(machine, hold)
        at = machine.sim.shaft()
        end(machine)
        machine.start_daemon()
        state = machine.client.wait_online("feeder")
        self.assert_state(state, "STOPPING")
        self.assertEqual(sorted(hold.request_id for hold in state.holds), sorted([*ids, "guard-door"]))
        self.assertTrue(state.enabled)
        self.refused_move(machine, "request guard-door", f"request {ids[0]}")

        async def release(first, _):
            self.assertEqual(len(await first.release_stop(ids[0])), 1)
            with self.assertRaises(axisd.RefusedError):
                await first.jog(1.0).__aenter__()
            self.assertEqual(await first.release_stop("guard-door"), ())
        self.programs(machine, release)
        state = machine.client.state("feeder")
        self.assert_state(state, "STANDSTILL")
        self.assertEqual((machine.sim.shaft().position, machine.sim.shaft().starts), (at.position, at.starts), "M1")
        machine.client.to_done("MoveRelative", "feeder", distance=1.0)
        end(machine)
        machine.start_daemon()
        self.assertEqual(len(machine.client.wait_online("feeder").holds), 0)

    def test_outlives_a_restart(self):
        self.held_over(lambda machine: machine.daemon.terminate())

    def test_outlives_a_kill(self):
        self.held_over(lambda machine: machine.daemon.kill())

    def test_is_on_the_disk_when_it_is_answered(self):
        """However often: the daemon is killed the moment that the stop is answered."""
        machine = self.ready_feeder()
        for attempt in range(3):
            response = machine.client.call(machine.client.axis.Stop, axis_pb.StopRequest(
                axis="feeder", hold=True, options={"request_id": f"r{attempt}"}))
            machine.daemon.kill()
            self.assertEqual([hold.request_id for hold in response.holds], [f"r{n}" for n in range(attempt + 1)])
            machine.start_daemon()
            self.assertEqual(list(machine.client.state("feeder").holds), list(response.holds))

    def test_outlives_a_reload_that_removes_the_axis(self):
        machine = self.machine({"feeder": feeder(), "pusher": feeder(node=2)}).start()
        client = machine.client
        client.call(client.axis.Stop, axis_pb.StopRequest(axis="pusher", hold=True))
        client.wait_state("pusher", lambda s: not s.moving, "it rests")
        whole = pathlib.Path(machine.config).read_text()
        pathlib.Path(machine.config).write_text(whole[:whole.index("  pusher:")])
        wait_for(lambda: machine.axisctl("config", "reload").returncode == 0, "the axis is removed")
        self.assertEqual([state.axis for state in client.states()], ["feeder"])
        pathlib.Path(machine.config).write_text(whole)
        self.assertEqual(machine.axisctl("config", "reload").returncode, 0)
        self.assertEqual([hold.holder for hold in client.wait_online("pusher").holds], [OWN_NAME])
        self.refused("FAILED_PRECONDITION", "STOPPING", client.motion, "Enable", "pusher")
        self.assertEqual(machine.axisctl("release-stop", "pusher").returncode, 0)
        client.to_done("Enable", "pusher")

    def test_axisctl(self):
        machine = self.ready_feeder()
        done = machine.axisctl("stop", "feeder", "--hold", "--wait")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("axisctl release-stop feeder", done.stdout)
        self.assertEqual(machine.axisctl("group", "stop", "--axis", "feeder", "--hold", "--request-id", "door").returncode, 0)
        self.assertIn(f"{OWN_NAME} (request door)", machine.axisctl("state", "feeder").stdout)
        self.assertIn(f"still held by {OWN_NAME} (request door)", machine.axisctl("release-stop", "feeder").stdout)
        nobody = machine.axisctl("release-stop", "feeder")
        self.assertEqual(nobody.returncode, 4, nobody)
        self.assertIn(f"it is held by {OWN_NAME} (request door)", nobody.stderr)
        done = machine.axisctl("group", "release-stop", "--axis", "feeder", "--request-id", "door")
        self.assertEqual(done.returncode, 0, done)
        self.assertIn("feeder: released; a new command can move it", done.stdout)
        machine.client.to_done("MoveAbsolute", "feeder", position=1.0)
        self.assertIn(f"hold of {OWN_NAME} (request door) released by {OWN_NAME}",
                      machine.axisctl("events", "--kind", "stop").stdout)


class Identities(Scenario):
    """Of different clients, by their certificates."""

    def test_only_whoever_may_command_the_axis_releases_anothers(self):
        machine = self.machine({"feeder": feeder()})
        authority = Certificates(machine.directory, "ours")
        for name in ("server", "hmi", "panel"):
            authority.issue(name)
        machine.server = (f"{{ listen: 127.0.0.1:0, tls: {{ certificate: {authority.path('crt', 'server')}, "
                          f"key: {authority.path('key', 'server')}, client_ca: {authority.path('crt')} }} }}")
        machine.write_config()
        machine.start_lines()
        daemon = machine.start_daemon()
        port = wait_for(lambda: re.search(r"serves 'e2e' on port (\d+)", daemon.log()), "the port's number")[1]

        def connect(name):
            return axisd.connect(f"127.0.0.1:{port}", tls_ca=authority.path("crt"),
                                 tls_certificate=authority.path("crt", name), tls_key=authority.path("key", name))

        async def run():
            async with connect("hmi") as hmi, connect("panel") as panel:
                await hmi.axis("feeder").wait_online()
                await hmi.axis("feeder").enable()
                await panel.axis("feeder").stop(hold=True, request_id="door")
                for arguments in ({}, {"request_id": "door"}, {"mine": True}):
                    with self.assertRaisesRegex(axisd.RefusedError, r"held by panel \(request door\) since "):
                        await hmi.axis("feeder").release_stop(**arguments)
                async with panel.lease("feeder", ttl=30):
                    with self.assertRaises(axisd.RefusedError) as refused:
                        await hmi.axis("feeder").release_stop(everybody=True)
                    self.assertIs(refused.exception.reason, axisd.Reason.LEASE_REQUIRED)
                self.assertEqual(len((await hmi.axis("feeder").state()).holds), 1)
                async with hmi.lease("feeder", ttl=30) as lease:
                    self.assertEqual(await lease.axis("feeder").release_stop(everybody=True), ())
                async for event in hmi.events(kept=True):
                    if isinstance(event.content, axisd.StopHoldChange) and event.content.kind == "released":
                        self.assertEqual((event.content.holder, event.content.by), ("panel", "hmi"))
                        return
        asyncio.run(run())


if __name__ == "__main__":
    unittest.main()
