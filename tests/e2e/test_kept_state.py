"""The files of the state convict each other: an older copy is put back, files go, and motion waits until somebody has
accepted that."""
import json
import os
import pathlib
import resource
import shutil
import unittest

from harness import AXISD, OWN_NAME, Scenario, pb, run
from harness.client import error_pb, event_pb, system_pb


class KeptState(Scenario):
    def file(self, machine, name="state.v1"):
        return pathlib.Path(machine.state_directory) / name

    def state(self, machine):
        return json.loads(machine.axisctl("--json", "state").stdout)

    def events(self, machine):
        request = event_pb.WatchEventsRequest(after_sequence=0, kinds=[event_pb.EVENT_KIND_KEPT_STATE_CHANGE])
        stream = machine.client.event.WatchEvents(request)
        try:
            return [event.kept_state_change for event in next(stream).events]
        finally:
            stream.cancel()

    def restart(self, machine):
        machine.start_daemon()
        machine.client.wait_online("feeder")

    def moved_and_ended(self):
        """A machine whose daemon has ended after a move; `older` is a copy of the state file of before that."""
        machine = self.ready_feeder()
        machine.daemon.terminate()
        older = pathlib.Path(machine.path("older"))
        shutil.copy(self.file(machine), older)
        self.restart(machine)
        machine.client.to_done("Enable", "feeder")
        machine.client.to_done("MoveRelative", "feeder", distance=5.0, request_id="once")
        machine.daemon.terminate()
        return machine, older

    def assert_waits(self, machine, *texts):
        starts = machine.sim.shaft().starts
        for name, fields in (("MoveRelative", {"distance": 1.0}), ("Jog", {"velocity": 1.0}), ("Home", {})):
            detail = self.refused("FAILED_PRECONDITION", "STATE_UNACCEPTED", machine.client.motion, name, "feeder",
                                  **fields)
            for text in texts:
                self.assertIn(text, detail.message)
            self.assertIn("axisctl state accept", detail.remedy)
        for name in ("Halt", "Stop"):
            machine.client.to_done(name, "feeder")
        self.assertEqual(machine.sim.shaft().starts, starts)

    def test_an_older_copy_of_the_state_is_told_and_waits_to_be_accepted(self):
        machine, older = self.moved_and_ended()
        shutil.copy(older, self.file(machine))
        before = None
        for _ in range(2):  # also over a restart
            self.restart(machine)
            self.assertIn("state.v1 was rolled back", machine.daemon.log())
            self.assert_waits(machine, "state.v1 was rolled back")
            machine.client.to_done("Enable", "feeder")
            self.assertIn("state.v1 was rolled back", machine.client.info().state_unaccepted)
            state = self.state(machine)
            (conviction,) = state["convictions"]
            self.assertEqual((conviction["file"], conviction["fault"]), ("state.v1", "STATE_FAULT_ROLLED_BACK"))
            self.assertLess(int(conviction["found"]), int(conviction["expected"]))
            self.assertGreater(int(state["start_count"]), 65536)
            self.assertEqual(conviction["since"], before or conviction["since"])
            before = conviction["since"]
            shown = machine.axisctl("state")
            self.assertIn("state.v1 was rolled back", shown.stdout)
            self.assertIn("axisctl state accept", shown.stdout)
            self.assertIn("motion waits", machine.axisctl("events", "--kind", "kept-state").stdout)
            machine.daemon.terminate()
        self.restart(machine)
        accepted = machine.axisctl("state", "accept")
        self.assertEqual(accepted.returncode, 0, accepted.stderr)
        self.assertIn("accepted: state.v1 was rolled back", accepted.stdout)
        waited, told = self.events(machine)
        self.assertEqual((waited.accepted_by, told.accepted_by), ("", OWN_NAME))
        self.assertEqual(machine.client.info().state_unaccepted, "")
        starts = machine.sim.shaft().starts
        machine.client.to_done("Enable", "feeder")
        machine.client.to_done("MoveRelative", "feeder", distance=1.0)
        # The journal knows what was moved before: it does not move again.
        machine.client.to_done("MoveRelative", "feeder", distance=5.0, request_id="once")
        self.assertEqual(machine.sim.shaft().starts, starts + 1)
        machine.daemon.kill()
        self.restart(machine)
        self.assertEqual(self.state(machine)["convictions"], [])

    def test_a_lost_journal_moves_nothing_twice(self):
        machine, _ = self.moved_and_ended()
        for name, damage in (("gone", os.unlink), ("a FIFO", lambda file: (os.unlink(file), os.mkfifo(file)))):
            with self.subTest(name):
                damage(self.file(machine, "journal.v1"))
                self.restart(machine)
                self.assert_waits(machine, "journal.v1")
                self.assertEqual(machine.axisctl("state", "accept").returncode, 0)
                starts = machine.sim.shaft().starts
                detail = self.refused("UNAVAILABLE", "STORAGE", machine.client.motion, "MoveRelative", "feeder",
                                      distance=5.0, request_id="once")
                self.assertEqual(detail.outcome, error_pb.OUTCOME_UNKNOWN)
                self.assertEqual(machine.sim.shaft().starts, starts)
                machine.daemon.terminate()

    def test_neither_a_kill_nor_a_restart_is_a_conviction(self):
        machine = self.ready_feeder()
        for number in range(6):
            machine.client.to_done("MoveRelative", "feeder", distance=1.0)
            machine.daemon.kill() if number % 2 else machine.daemon.terminate()
            self.restart(machine)
            self.assertEqual(self.state(machine)["convictions"], [])
            machine.client.to_done("Enable", "feeder")

    def test_the_latch_outlives_the_loss_of_the_state(self):
        machine = self.ready_feeder()
        self.assertEqual(machine.axisctl("stop", "--all", "--wait").returncode, 0)
        machine.daemon.kill()
        self.file(machine).unlink()
        self.restart(machine)
        self.assertTrue(machine.client.info().inhibited)
        self.assertEqual(machine.axisctl("state", "accept").returncode, 0)
        self.assertTrue(machine.client.info().inhibited)
        # The other two files agree, and may be old copies: a request that they do not know may have been executed.
        self.refused("UNAVAILABLE", "STORAGE", machine.client.motion, "MoveRelative", "feeder", distance=1.0)

    def test_a_backup_comes_back_as_an_old_state(self):
        machine = self.ready_feeder()
        move = self.move_under_way(machine)
        backup = machine.path("backup")
        done = machine.axisctl("state", "backup", backup)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertIn("--restore-state", done.stdout)
        self.assertEqual(os.stat(backup).st_mode & 0o777, 0o600)
        self.assert_command(machine.client.wait_ended(move), "DONE")
        machine.client.to_done("MoveRelative", "feeder", distance=5.0, request_id="behind-it")

        def restore():
            return run([AXISD, "--config", machine.config, "--restore-state", backup], limit=60)
        refused = restore()
        self.assertEqual(refused.returncode, 1)
        self.assertIn("is used by another axisd", refused.stderr)
        machine.daemon.terminate()
        starts = machine.sim.shaft().starts
        restored = restore()
        self.assertEqual((restored.returncode, restored.stderr), (0, ""))
        self.assertIn("axisctl state accept", restored.stdout)
        self.restart(machine)
        self.assert_waits(machine, "journal.v1")
        self.assertEqual(machine.axisctl("state", "accept").returncode, 0)
        self.assertEqual(machine.axisctl("release-stop", "--all").returncode, 0)
        # What was moved after the backup does not move again: nobody knows what it was.
        detail = self.refused("UNAVAILABLE", "STORAGE", machine.client.motion, "MoveRelative", "feeder",
                              distance=5.0, request_id="behind-it")
        self.assertEqual(detail.outcome, error_pb.OUTCOME_UNKNOWN)
        self.assertEqual(machine.sim.shaft().starts, starts)

    def test_stop_all_on_a_full_disk_says_so(self):
        machine = self.ready_feeder()
        resource.prlimit(machine.daemon.process.pid, resource.RLIMIT_FSIZE, (0, resource.RLIM_INFINITY))
        answer = machine.client.call(machine.client.system.StopAll,
                                     system_pb.StopAllRequest(wait_until=pb.WAIT_UNTIL_DONE))
        self.assertEqual(answer.not_durable.reason, error_pb.REASON_STORAGE)
        self.assertTrue(machine.client.info().inhibited)
        told = machine.axisctl("stop", "--all")
        self.assertEqual(told.returncode, 1)
        self.assertIn("would not outlive a restart", told.stderr)
        resource.prlimit(machine.daemon.process.pid, resource.RLIMIT_FSIZE,
                         (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        self.assertEqual(machine.axisctl("stop", "--all").returncode, 0)
        machine.daemon.kill()
        self.restart(machine)
        self.assertTrue(machine.client.info().inhibited)


if __name__ == "__main__":
    unittest.main()
