"""What the daemon remembers, and its acceptance: axisctl state and Machine.state() against the fake daemon."""
import json
import os
import pathlib
import tempfile
import unittest

from fake_state import TEXT
from support import AxisctlTest, PythonTest
import axisd
from axisd.v1 import error_pb2, system_service_pb2 as pb

FULL = error_pb2.ErrorDetail(reason=error_pb2.REASON_STORAGE, message="the latch would not outlive a restart",
                             remedy="free space on the disk")

NOTICE = {"kind": "CERTIFICATE_NOTICE_KIND_EXPIRES_SOON", "path": "/etc/server.crt",
          "text": "/etc/server.crt expires in 20 days: renew it"}


class Axisctl(AxisctlTest):
    def test_all_is_well(self):
        shown = self.ok("state")
        self.assertIn("state.v1:   generation 12 at the start of the daemon, at least 40 expected\n", shown)
        self.assertIn("journal.v1: line 120 at the start of the daemon, the other file does not say", shown)
        self.assertIn("accepted:   yes", shown)
        self.assertEqual(self.ok("state", "accept"), "there was nothing to accept\n")

    def test_where_nothing_exists_yet(self):
        self.server.machine.kept_files = [pb.KeptFileState(name="state.v1"), pb.KeptFileState(name="journal.v1", expected=7)]
        shown = self.ok("state")
        self.assertIn("state.v1:   none at the start of the daemon, nor does the other file know of one\n", shown)
        self.assertIn("journal.v1: none at the start of the daemon, at least 7 expected\n", shown)

    def test_what_is_wrong_and_since_when_until_it_is_accepted(self):
        self.server.machine.convict()
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
        self.server.machine.convict()
        self.assertIn("of the whole machine", self.fails(2, "state", "feeder", "accept"))
        self.assertIn(TEXT, self.ok("state"))

    def test_json(self):
        self.server.machine.convict()
        self.assertEqual(self.json("state")[0]["convictions"][0]["fault"], "STATE_FAULT_ROLLED_BACK")
        self.assertEqual(self.json("state", "accept")[0]["accepted"][0]["text"], TEXT)
        self.assertEqual(self.json("state")[0]["convictions"], [])

    def test_who_called_and_who_released_stop_all_are_events(self):
        self.run_axisctl("stop", "--all")
        self.ok("release-stop", "--all")
        shown = self.ok("events", "--kind", "inhibit")
        self.assertIn("StopAll by test: motion is inhibited until it is released\n", shown)
        self.assertIn("StopAll released by test\n", shown)

    def test_certificates_are_events(self):
        self.server.machine.happen("", certificate_notice=NOTICE)
        self.assertIn("/etc/server.crt expires in 20 days: renew it\n", self.ok("events", "--kind", "certificate"))

    def test_stop_all_says_that_its_latch_is_not_on_the_disk(self):
        self.server.machine.latch_trouble = FULL
        done = self.run_axisctl("stop", "--all")
        self.assertEqual(done.returncode, 1)
        self.assertIn("feeder  Stop", done.stdout)
        self.assertEqual(done.stderr, "axisctl: the latch would not outlive a restart; free space on the disk\n")
        done = self.run_axisctl("--json", "stop", "--all")
        self.assertEqual(json.loads(done.stdout)["not_durable"]["reason"], "REASON_STORAGE")


    def test_a_backup_that_fails_leaves_the_one_before_and_nothing_else(self):
        with tempfile.TemporaryDirectory() as directory:
            path = pathlib.Path(directory) / "backup"
            self.assertIn("generation 12", self.ok("state", "backup", str(path)))
            self.server.machine.storage_error = FULL
            self.assertIn("free space", self.fails(4, "state", "backup", str(path)))
            self.server.machine.storage_error = None
            self.assertIn("cannot be written: Is a directory", self.fails(2, "state", "backup", directory))
            self.assertEqual((path.read_text(), os.listdir(directory)), ("axisd-state 2\n", ["backup"]))
            self.assertEqual(list(path.parent.parent.glob(f"{path.parent.name}.*")), [])

    def test_motion_is_not_permitted_while_the_disk_is_full(self):
        self.server.machine.storage_error = FULL
        full = "nothing new is started: the latch would not outlive a restart; free space on the disk"
        self.assertIn(f"motion:     {full}\n", self.ok("info"))
        self.server.machine.convict()
        self.assertIn(f": {TEXT}; {full}\n", self.ok("info"))
        self.assertIn("commands:   the latch would not outlive a restart; free space on the disk\n", self.ok("state"))


class Python(PythonTest):
    async def test_what_is_wrong_until_it_is_accepted(self):
        self.assertTrue((await self.machine.state()).accepted)
        self.assertEqual(await self.machine.accept_state(), [])
        info = await self.machine.info()
        self.assertEqual((info.state_unaccepted, info.storage_error), ("", None))
        self.fake.storage_error = FULL
        self.assertEqual((await self.machine.info()).storage_error.remedy, "free space on the disk")
        self.fake.convict()
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
        async for event in self.machine.events(kept=True):
            if isinstance(event.content, axisd.KeptStateChange):
                seen.append(event.content)
                if event.content.accepted_by:
                    break
        self.assertEqual(seen, [axisd.KeptStateChange((conviction,), ""), axisd.KeptStateChange((conviction,), "test")])

    async def test_who_called_and_who_released_stop_all_are_events(self):
        await self.machine.stop_all()
        await self.machine.release_stop_all()
        seen = []
        async for event in self.machine.events(kept=True):
            if isinstance(event.content, axisd.InhibitChange):
                seen.append(event.content)
                if event.content.kind == "released":
                    break
        self.assertEqual(seen, [axisd.InhibitChange("latched", "test"), axisd.InhibitChange("released", "test")])

    async def test_certificates_are_events(self):
        self.fake.happen("", certificate_notice=NOTICE)
        async for event in self.machine.events(kept=True):
            if isinstance(event.content, axisd.CertificateNotice):
                break
        told = event.content
        self.assertEqual((told.kind, told.path, told.text), ("expires_soon", "/etc/server.crt", NOTICE["text"]))
        self.assertIsNone(told.expires)

    async def test_stop_all_says_that_its_latch_is_not_on_the_disk(self):
        self.assertIsNone((await self.machine.stop_all()).not_durable)
        self.fake.latch_trouble = FULL
        stopped = await self.machine.stop_all()
        self.assertEqual(stopped.not_durable.reason, "storage")
        self.assertIn("feeder", [result.axis for result in stopped])


if __name__ == "__main__":
    unittest.main()
