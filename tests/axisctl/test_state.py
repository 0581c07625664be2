"""What the daemon remembers, and its acceptance: axisctl state and Machine.state()."""
import asyncio
import json
import os
import pathlib
import tempfile
import unittest

import simulated  # noqa: F401  (makes axisd and the harness importable)
from between import Open
from harness.programs import OWN_NAME
from support import AxisctlTest, PythonTest
import axisd
from axisd.v1 import error_pb2, event_service_pb2 as event_pb, system_service_pb2 as pb, types_pb2

TEXT = "state.v1 was rolled back: it has generation 12, but there was generation 40"
CONVICTION = types_pb2.StateConviction(file="state.v1", fault=types_pb2.STATE_FAULT_ROLLED_BACK, found=12, expected=40, text=TEXT,
                                       since={"seconds": 1_700_000_000})
FILES = [pb.KeptFileState(name="state.v1", generation=12, expected=40), pb.KeptFileState(name="journal.v1", generation=120)]
FULL = error_pb2.ErrorDetail(reason=error_pb2.REASON_STORAGE, message="the latch would not outlive a restart",
                             remedy="free space on the disk")

NOTICE = {"kind": "CERTIFICATE_NOTICE_KIND_EXPIRES_SOON", "path": "/etc/server.crt",
          "text": "/etc/server.crt expires in 20 days: renew it"}


def event(number, **content):
    return event_pb.Event(sequence=number, at={"seconds": 1_700_000_000}, **content)


def happened(*events):
    return Open([event_pb.WatchEventsResponse(instance_id="canned", events=events, cursor=len(events), newest=len(events))])


def convict(answers, storage_error=None):
    """As a daemon whose state was damaged answers, until somebody accepts it."""
    refusal = error_pb2.ErrorDetail(reason=error_pb2.REASON_STATE_UNACCEPTED, message=TEXT, remedy="axisctl state accept")

    def accept(_):
        answers.clear()
        answers["WatchEvents"] = happened(event(1, kept_state_change={"convictions": [CONVICTION]}),
                                          event(2, kept_state_change={"convictions": [CONVICTION], "accepted_by": "test"}))
        return pb.AcceptStateResponse(accepted=[CONVICTION])
    answers |= {"GetState": pb.GetStateResponse(files=FILES, convictions=[CONVICTION], start_count=65544),
                "GetInfo": pb.GetInfoResponse(machine="press-1", state_unaccepted=TEXT, storage_error=storage_error),
                "MoveAbsolute": refusal, "AcceptState": accept}


class Axisctl(AxisctlTest):
    def test_all_is_well(self):
        self.assertRegex(self.ok("state"), r"state\.v1: .*\njournal\.v1: .*\n(.*\n)*accepted: +yes")
        self.server.answers["GetState"] = pb.GetStateResponse(files=FILES)
        shown = self.ok("state")
        self.assertIn("state.v1:   generation 12 at the start of the daemon, at least 40 expected\n", shown)
        self.assertIn("journal.v1: line 120 at the start of the daemon, the other file does not say", shown)
        self.assertIn("accepted:   yes", shown)
        self.assertEqual(self.ok("state", "accept"), "there was nothing to accept\n")

    def test_where_nothing_exists_yet(self):
        self.server.answers["GetState"] = pb.GetStateResponse(files=[
            pb.KeptFileState(name="state.v1"), pb.KeptFileState(name="journal.v1", expected=7)])
        shown = self.ok("state")
        self.assertIn("state.v1:   none at the start of the daemon, nor does the other file know of one\n", shown)
        self.assertIn("journal.v1: none at the start of the daemon, at least 7 expected\n", shown)

    def test_what_is_wrong_and_since_when_until_it_is_accepted(self):
        convict(self.server.answers)
        line = f"{TEXT}, since 2023-11-14T22:13:20Z"
        self.assertIn(f"{line}\nmotion waits: look at the machine, then 'axisctl state accept'\n", self.ok("state"))
        self.assertIn(f"waits until the state is accepted ('axisctl state accept'): {TEXT}", self.ok("info"))
        self.assertIn(TEXT, self.fails(4, "move", "feeder", "1"))
        self.ok("stop", "feeder")
        self.ok("state", "feeder")
        self.assertIn(f"accepted: {line}\n", self.ok("state", "accept"))
        self.assertIn("permitted", self.ok("info"))
        self.ok("move", "feeder", "1", "--wait")
        shown = self.ok("events", "--kind", "kept-state")
        self.assertIn(f"motion waits until the state is accepted: {TEXT}", shown)
        self.assertIn(f"state accepted by test: {TEXT}", shown)

    def test_accepting_is_not_of_one_axis(self):
        convict(self.server.answers)
        self.assertIn("of the whole machine", self.fails(2, "state", "feeder", "accept"))
        self.assertIn(TEXT, self.ok("state"))

    def test_json(self):
        convict(self.server.answers)
        self.assertEqual(self.json("state")[0]["convictions"][0]["fault"], "STATE_FAULT_ROLLED_BACK")
        self.assertEqual(self.json("state", "accept")[0]["accepted"][0]["text"], TEXT)
        self.assertEqual(self.json("state")[0]["convictions"], [])

    def test_who_called_and_who_released_stop_all_are_events(self):
        self.run_axisctl("stop", "--all")
        self.ok("release-stop", "--all")
        shown = self.ok("events", "--kind", "inhibit")
        self.assertIn(f"StopAll by {OWN_NAME}: motion is inhibited until it is released\n", shown)
        self.assertIn(f"StopAll released by {OWN_NAME}\n", shown)

    def test_certificates_are_events(self):
        self.server.answers["WatchEvents"] = happened(event(1, certificate_notice=NOTICE))
        self.assertIn("/etc/server.crt expires in 20 days: renew it\n", self.ok("events", "--kind", "certificate"))

    def test_stop_all_says_that_its_latch_is_not_on_the_disk(self):
        self.server.answers["StopAll"] = pb.StopAllResponse(not_durable=FULL, results=[
            {"axis": "feeder", "command": {"id": "s-1", "axis": "feeder", "kind": types_pb2.COMMAND_KIND_STOP,
                                           "state": types_pb2.COMMAND_STATE_DONE}}])
        done = self.run_axisctl("stop", "--all")
        self.assertEqual(done.returncode, 1)
        self.assertIn("feeder  Stop", done.stdout)
        self.assertEqual(done.stderr, "axisctl: the latch would not outlive a restart; free space on the disk\n")
        done = self.run_axisctl("--json", "stop", "--all")
        self.assertEqual(json.loads(done.stdout)["not_durable"]["reason"], "REASON_STORAGE")


    def test_a_backup_that_fails_leaves_the_one_before_and_nothing_else(self):
        with tempfile.TemporaryDirectory() as directory:
            path = pathlib.Path(directory) / "backup"
            self.assertRegex(self.ok("state", "backup", str(path)), r"generation \d+")
            kept = path.read_text()
            self.server.answers["BackUpState"] = FULL
            self.assertIn("free space", self.fails(4, "state", "backup", str(path)))
            self.server.answers.clear()
            self.assertIn("cannot be written: Is a directory", self.fails(2, "state", "backup", directory))
            self.assertEqual((path.read_text(), os.listdir(directory)), (kept, ["backup"]))
            self.assertTrue(kept.startswith("axisd-state "))
            self.assertEqual(list(path.parent.parent.glob(f"{path.parent.name}.*")), [])

    def test_motion_is_not_permitted_while_the_disk_is_full(self):
        self.server.answers["GetInfo"] = pb.GetInfoResponse(machine="press-1", storage_error=FULL)
        full = "nothing new is started: the latch would not outlive a restart; free space on the disk"
        self.assertIn(f"motion:     {full}\n", self.ok("info"))
        convict(self.server.answers, storage_error=FULL)
        self.assertIn(f": {TEXT}; {full}\n", self.ok("info"))
        self.assertIn("commands:   the latch would not outlive a restart; free space on the disk\n", self.ok("state"))


class Python(PythonTest):
    async def test_what_is_wrong_until_it_is_accepted(self):
        self.assertTrue((await self.machine.state()).accepted)
        self.assertEqual(await self.machine.accept_state(), [])
        info = await self.machine.info()
        self.assertEqual((info.state_unaccepted, info.storage_error), ("", None))
        self.between.answers["GetInfo"] = pb.GetInfoResponse(storage_error=FULL)
        self.assertEqual((await self.machine.info()).storage_error.remedy, "free space on the disk")
        convict(self.between.answers)
        state = await self.machine.state()
        self.assertFalse(state.accepted)
        self.assertEqual((state.start_count, state.files[0]), (65544, axisd.KeptFile("state.v1", 12, 40)))
        (conviction,) = state.convictions
        self.assertEqual((conviction.file, conviction.fault, conviction.found, conviction.expected, str(conviction),
                          conviction.since.timestamp()), ("state.v1", "rolled_back", 12, 40, TEXT, 1_700_000_000))
        self.assertEqual((await self.machine.info()).state_unaccepted, TEXT)
        with self.assertRaises(axisd.RefusedError) as raised:
            await self.machine.axis("feeder").move(1)
        self.assertIs(raised.exception.reason, axisd.Reason.STATE_UNACCEPTED)
        self.assertEqual(await self.machine.accept_state(), [conviction])
        await self.machine.axis("feeder").move(1)
        seen = []
        async for told in self.machine.events(kept=True):
            if isinstance(told.content, axisd.KeptStateChange):
                seen.append(told.content)
                if told.content.accepted_by:
                    break
        self.assertEqual(seen, [axisd.KeptStateChange((conviction,), ""), axisd.KeptStateChange((conviction,), "test")])

    async def test_who_called_and_who_released_stop_all_are_events(self):
        async def seen():
            changes = []
            async for told in self.machine.events():
                if isinstance(told.content, axisd.InhibitChange):
                    changes.append(told.content)
                    if told.content.kind == "released":
                        return changes
        seeing = asyncio.create_task(seen())
        while not self.calls("WatchEvents"):
            await asyncio.sleep(0.01)
        await self.machine.stop_all(wait=False)
        await self.machine.release_stop_all()
        self.assertEqual(await seeing, [axisd.InhibitChange("latched", OWN_NAME), axisd.InhibitChange("released", OWN_NAME)])

    async def test_certificates_are_events(self):
        self.between.answers["WatchEvents"] = happened(event(1, certificate_notice=NOTICE))
        async for told in self.machine.events(kept=True):
            if isinstance(told.content, axisd.CertificateNotice):
                break
        notice = told.content
        self.assertEqual((notice.kind, notice.path, notice.text), ("expires_soon", "/etc/server.crt", NOTICE["text"]))
        self.assertIsNone(notice.expires)

    async def test_stop_all_says_that_its_latch_is_not_on_the_disk(self):
        self.assertIsNone((await self.machine.stop_all(wait=False)).not_durable)
        self.between.answers["StopAll"] = pb.StopAllResponse(not_durable=FULL, results=[
            {"axis": "feeder", "command": {"state": types_pb2.COMMAND_STATE_DONE}}])
        stopped = await self.machine.stop_all()
        self.assertEqual(stopped.not_durable.reason, "storage")
        self.assertIn("feeder", [result.axis for result in stopped])


if __name__ == "__main__":
    unittest.main()
