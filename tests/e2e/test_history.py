"""What happened stays readable: commands of all clients with their ends, and the causes of faults."""
import asyncio
import unittest

from harness import DONE, OWN_NAME, Scenario, error_pb, pb
from harness.client import event_pb
import axisd  # noqa: E402  (made by the harness)


class History(Scenario):
    def events(self, machine, *kinds):
        stream = machine.client.event.WatchEvents(event_pb.WatchEventsRequest(after_sequence=0, kinds=kinds))
        try:
            return list(next(stream).events)
        finally:
            stream.cancel()

    def test_commands(self):
        machine = self.ready_feeder()
        machine.client.to_done("MoveAbsolute", "feeder", position=12.5, request_id="r-1")
        move = self.move_under_way(machine)
        stop = machine.client.motion("Stop", "feeder", wait=DONE)

        async def commands():
            async with axisd.connect(f"unix:{machine.socket}") as client:
                return await client.commands("feeder", 3), await client.commands(limit=100)
        newest, all_of_them = asyncio.run(commands())
        self.assertEqual([command.id for command in newest[:2]], [stop.id, move.id])
        self.assertEqual((newest[1].state, newest[1].cause.reason), (axisd.CommandState.ABORTED, axisd.Reason.SUPERSEDED))
        self.assertEqual((newest[2].request_id, newest[2].asked.position, newest[2].client), ("r-1", 12.5, OWN_NAME))
        self.assertEqual(len(all_of_them), 5)
        self.assertEqual(all_of_them[-1].kind, "enable")

        done = machine.axisctl("command", "list", "feeder", "--limit", "2")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        lines = done.stdout.splitlines()
        self.assertEqual(len(lines), 3)
        self.assertRegex(lines[1], rf"feeder +Stop +Done +.*{OWN_NAME} +{stop.id}")
        self.assertRegex(lines[2], rf"feeder +MoveAbsolute +300 +Aborted +.*{move.id} +.*{stop.id}")
        self.assertEqual(machine.axisctl("command", "list", "feedr").returncode, 4)

        seen = [(pb.CommandKind.Name(e.command_change.command.kind)[13:], pb.CommandState.Name(e.command_change.command.state)[14:])
                for e in self.events(machine, event_pb.EVENT_KIND_COMMAND_CHANGE)]
        self.assertEqual(seen[:2], [("ENABLE", "ACCEPTED"), ("ENABLE", "DONE")])
        self.assertEqual(seen[-4:], [("MOVE_ABSOLUTE", "ACCEPTED"), ("STOP", "ACCEPTED"), ("MOVE_ABSOLUTE", "ABORTED"),
                                     ("STOP", "DONE")])
        told = machine.axisctl("events", "--kind", "command").stdout
        self.assertIn(stop.id, told)
        self.assertIn(f"by {OWN_NAME}", told)

    def test_renewals_of_a_jog_are_neither_events_nor_lines_of_the_log(self):
        machine = self.ready_feeder()
        for _ in range(10):
            jog = machine.client.motion("Jog", "feeder", request_id="jog", velocity=5.0, hold=1.0)
        machine.client.wait_ended(jog)
        self.assertEqual(len([e for e in self.events(machine, event_pb.EVENT_KIND_COMMAND_CHANGE)
                              if e.command_change.command.id == jog.id]), 2)
        self.assertEqual(machine.daemon.log().count(f"({jog.id})"), 1)

    def test_a_fault_with_its_cause(self):
        machine = self.ready_feeder()
        machine.sim.control("alarm 1 2")
        machine.client.wait_state("feeder", lambda s: s.state == pb.STATE_ERROR_STOP, "in ErrorStop")
        (event,) = self.events(machine, event_pb.EVENT_KIND_AXIS_FAULT)
        cause = event.axis_fault.cause
        self.assertEqual((event.axis, cause.reason, cause.native_code, cause.bus, cause.node),
                         ("feeder", error_pb.REASON_ALARM, 2, "line", 1))
        self.assertIn("fault: ", machine.axisctl("events", "--kind", "axis-fault").stdout)


if __name__ == "__main__":
    unittest.main()
