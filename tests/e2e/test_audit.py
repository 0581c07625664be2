"""Who asked for what stays known: over restarts, after kill -9 at any moment, beside a full disk. AXISD_KILLS: how often the
daemon is killed (8)."""
import asyncio
import json
import os
import pathlib
import random
import re
import resource
import threading
import time
import unittest

from harness import DONE, OWN_NAME, CallFailed, Scenario, pb, wait_for
from harness.client import audit_pb, drive_pb
import axisd  # noqa: E402  (made by the harness)

KILLS = int(os.environ.get("AXISD_KILLS", "8"))


class AuditScenario(Scenario):
    def audit(self, machine, **filters):
        """All records, by the Python client."""
        async def read():
            async with axisd.connect(f"unix:{machine.socket}") as client:
                return [record async for record in client.audit(**filters)]
        return asyncio.run(read())

    def wait_audit(self, machine, condition, what):
        """The records, once they fulfil the condition: they are written beside what they tell of."""
        def fulfilled():
            records = self.audit(machine)
            return records if condition(records) else None
        return wait_for(fulfilled, what)

    def files(self, machine):
        return sorted((pathlib.Path(machine.state_directory) / "audit").iterdir())

    def ready_again(self, machine, axis):
        machine.start_daemon()
        machine.client.wait_online(axis)
        state = machine.client.wait_state(axis, lambda s: s.state in (pb.STATE_DISABLED, pb.STATE_STANDSTILL,
                                                                      pb.STATE_ERROR_STOP), "it rests")
        if state.state == pb.STATE_ERROR_STOP:
            machine.client.to_done("Reset", axis)
        machine.client.to_done("Enable", axis)


class Audit(AuditScenario):
    def test_who_asked_for_what(self):
        machine = self.ready_feeder()
        move = machine.client.to_done("MoveRelative", "feeder", distance=5.0, request_id="r-1")
        refused = self.refused("OUT_OF_RANGE", "SOFT_LIMIT", machine.client.motion, "MoveAbsolute", "feeder", position=999.0)
        machine.axisctl("stop", "--all")
        records = self.wait_audit(machine, lambda found: any(r.kind == "inhibit" for r in found), "StopAll is told")
        self.assertEqual([r.number for r in records], list(range(1, len(records) + 1)))
        self.assertEqual((records[0].kind, records[0].raw.run.kind), ("daemon", audit_pb.DAEMON_RUN_KIND_BEGAN))
        accepted, ended = [r for r in records if r.command and r.command.id == move.id]
        self.assertEqual((accepted.client, accepted.rpc, accepted.request_id), (OWN_NAME, "AxisService.MoveRelative", "r-1"))
        self.assertEqual((accepted.command.state, ended.command.state), (axisd.CommandState.ACCEPTED, axisd.CommandState.DONE))
        self.assertEqual(accepted.command.asked.distance, 5.0)
        self.assertTrue(ended.command.granted.velocity)
        self.assertTrue(accepted.raw.revision and accepted.raw.instance_id and accepted.raw.uptime.seconds)
        (refusal,) = [r for r in records if r.kind == "refusal"]
        self.assertEqual((refusal.error.message, refusal.command.asked.position), (refused.message, 999.0))
        only = self.audit(machine, axes=["feeder"], kinds=["refusal"])
        self.assertEqual([r.number for r in only], [refusal.number])
        self.assertEqual(self.audit(machine, clients=["nobody"]), [])

        # Each line is JSON, and one more restart goes on with the numbers.
        (file,) = self.files(machine)
        lines = [json.loads(line) for line in file.read_text().splitlines()]
        self.assertEqual([int(line["number"]) for line in lines], list(range(1, len(lines) + 1)))
        machine.daemon.terminate()
        machine.start_daemon()
        machine.client.wait_online("feeder")
        kinds = [r.raw.run.kind for r in self.audit(machine, kinds=["daemon"])]
        self.assertEqual(kinds, [audit_pb.DAEMON_RUN_KIND_BEGAN, audit_pb.DAEMON_RUN_KIND_ENDED,
                                 audit_pb.DAEMON_RUN_KIND_BEGAN])

    def test_a_parameter_with_what_it_was(self):
        machine = self.ready_spinner()
        machine.client.to_done("Disable", "spinner")
        before = machine.sim.peek(0x0034)
        machine.client.call(machine.client.drive.WriteParameters, drive_pb.WriteParametersRequest(
            axis="spinner", values=[{"name": "homing_time", "value": before + 50}]))
        records = self.wait_audit(machine, lambda found: len([r for r in found if r.kind == "call"]) == 2, "it is told")
        asked, done = [r for r in records if r.kind == "call"]
        self.assertEqual((asked.client, asked.axis, asked.rpc), (OWN_NAME, "spinner", "DriveService.WriteParameters"))
        (written,) = done.raw.call.parameters
        self.assertEqual((written.name, written.asked, written.before, written.after),
                         ("homing_time", before + 50, before, before + 50))
        self.assertIn(f"homing_time {before} -> {before + 50}", machine.axisctl("audit", "--kind", "call").stdout)

    def test_axisctl(self):
        machine = self.ready_feeder()
        move = machine.client.to_done("MoveRelative", "feeder", distance=5.0)
        machine.client.to_done("MoveRelative", "feeder", distance=-2.0)
        machine.client.to_done("Stop", "feeder")
        self.wait_audit(machine, lambda found: any(r.rpc == "AxisService.Stop" and r.command.state.ended for r in found),
                        "the end of the stop is told")
        shown = machine.axisctl("audit", "feeder", "--kind", "command", "--since", "10min")
        self.assertEqual((shown.returncode, shown.stderr), (0, ""))
        self.assertEqual(shown.stdout.count(move.id), 2)
        self.assertRegex(shown.stdout, rf"feeder  {re.escape(OWN_NAME)}  .*MoveRelative  Done")
        self.assertNotIn(f"by {OWN_NAME}", shown.stdout, "it stands in a column of its own")
        self.assertEqual(len(machine.axisctl("audit", "--last", "3").stdout.splitlines()), 3)
        self.assertEqual(machine.axisctl("audit", "--kind", "noise").returncode, 2)
        none = machine.axisctl("audit", "--kind", "gap")
        self.assertEqual((none.returncode, none.stdout), (0, "the audit has no such record\n"))
        self.assertEqual(machine.axisctl("--json", "audit", "--kind", "gap").stdout, "")
        self.assertEqual(machine.axisctl("audit", "feedr").stdout,
                         "the audit has no such record; 'feedr' is no axis or group now\n")
        self.assertEqual(machine.axisctl("audit", "--last", "-1").returncode, 2)
        self.assertIn("--since: 'foo' is neither a number nor a time", machine.axisctl("audit", "--since", "foo").stderr)
        self.assertEqual(json.loads(machine.axisctl("--json", "audit", "--last", "1").stdout)["kind"], "AUDIT_KIND_COMMAND")
        report = machine.axisctl("report", "feeder")
        self.assertEqual((report.returncode, report.stderr), (0, ""))
        self.assertRegex(report.stdout, r"motions: +2: 2 done\n")
        self.assertRegex(report.stdout, r"distance: +7 mm from start to target\n")
        self.assertRegex(report.stdout, r"stops: +1\n")
        self.assertRegex(report.stdout, r"\ncounted since \d{4}-\d\d-\d\dT[0-9:.]+Z\n\Z")
        self.assertEqual(machine.axisctl("report", "feeder", "--since", "8h").returncode, 0)
        self.assertEqual(json.loads(machine.axisctl("--json", "report", "feeder").stdout)["distance"], 7)


class Killed(AuditScenario):
    def test_what_reached_a_wire_has_its_record(self):
        machine = self.ready_spinner()
        chance, reached = random.Random(27), []

        def move(request_id):
            try:
                machine.client.motion("MoveRelative", "spinner", wait=DONE, distance=0.5, request_id=request_id)
            except CallFailed:
                pass  # the daemon was killed
        for number in range(KILLS):
            starts, request_id = machine.sim.shaft().starts, f"kill-{number}"
            caller = threading.Thread(target=move, args=(request_id,))
            caller.start()
            time.sleep(chance.uniform(0, 0.5))
            machine.daemon.kill()
            caller.join()
            machine.sim.wait_rest()
            if machine.sim.shaft().starts > starts:
                reached.append(request_id)
            self.ready_again(machine, "spinner")
        records = self.audit(machine, kinds=["command"])
        told = {r.request_id for r in records}
        ended = {r.request_id for r in records if r.command.state.ended}
        self.assertTrue(reached, "no kill came late enough")
        self.assertEqual([each for each in reached if each not in told], [])
        self.assertEqual([each for each in reached if each not in ended], [])

    def test_what_the_disk_never_got_comes_from_the_command_journal(self):
        machine = self.ready_feeder()
        (file,) = self.files(machine)
        before = file.read_text()
        done = machine.client.to_done("MoveRelative", "feeder", distance=1.0, request_id="done")
        self.wait_audit(machine, lambda found: any(r.request_id == "done" and r.command.state.ended for r in found),
                        "its end is told")
        machine.client.motion("MoveAbsolute", "feeder", position=200.0, request_id="cut")
        machine.sim.wait_moving()
        machine.daemon.kill()
        file.write_text(before)
        self.ready_again(machine, "feeder")
        recovered = [r for r in self.audit(machine, kinds=["command"]) if r.recovered]
        self.assertEqual([r.request_id for r in recovered][-2:], ["done", "cut"])
        self.assertEqual(recovered[-2].command.state, axisd.CommandState.DONE)
        self.assertEqual(recovered[-2].command.id, done.id)
        self.assertTrue(recovered[-1].raw.recovered.sent)
        ends = [r for r in self.audit(machine) if r.request_id == "cut" and not r.recovered]
        self.assertTrue(ends and ends[-1].command.state.ended, "what became of it is told, too")


class FullDisk(AuditScenario):
    def limit(self, machine, size):
        resource.prlimit(machine.daemon.process.pid, resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))

    def test_stops_are_executed_and_told_later(self):
        machine = self.ready_feeder()
        self.move_under_way(machine)
        self.limit(machine, 0)
        stop = machine.client.to_done("Stop", "feeder")

        def refused():
            try:
                machine.client.motion("MoveRelative", "feeder", wait=DONE, distance=1.0)
            except CallFailed as failure:
                return failure
            return None
        self.assertEqual(wait_for(refused, "motion is refused").reason, "REASON_STORAGE")
        self.assertIn("nothing new is started: cannot write ", machine.axisctl("info").stdout)
        machine.client.to_done("Halt", "feeder")
        self.limit(machine, resource.RLIM_INFINITY)
        wait_for(lambda: "motion:     permitted" in machine.axisctl("info").stdout, "motion is permitted again")
        records = self.wait_audit(machine, lambda found: any(r.rpc == "AxisService.Halt" and r.command.state.ended
                                                             for r in found), "the halt is told")
        self.assertEqual(len([r for r in records if r.command and r.command.id == stop.id]), 2)


if __name__ == "__main__":
    unittest.main()
