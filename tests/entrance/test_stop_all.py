"""StopAll of the cell: everybody at once, whoever comes back, until it is released."""
import pathlib
import time
import unittest

from harness import CallFailed, axis_pb, pb, system_pb, wait_for
from support import PRESENT, SILENT, CellScenario, cell_pb

DONE, GONE_SILENT = cell_pb.MACHINE_OUTCOME_DONE, cell_pb.MACHINE_OUTCOME_SILENT


class StopAll(CellScenario):
    def turning(self, *machines):
        for machine in machines:
            machine.client.to_done("Enable", "spinner")
            machine.client.motion("MoveVelocity", "spinner", velocity=3.0)
            machine.client.wait_state("spinner", lambda state: state.velocity > 2, "it turns")

    def outcomes(self, answer):
        return {each.machine: each.outcome for each in answer.machines}

    def test_stops_all_machines_and_answers_within_a_second(self):
        self.cell()
        self.turning(*self.presses)
        begin = time.monotonic()
        answer = self.entrances[0].stop_all("somebody shouted")
        took = time.monotonic() - begin
        self.assertEqual(self.outcomes(answer), {"press-1": DONE, "press-2": DONE, "press-3": DONE})
        self.assertLess(took, 5)  # 1 s on a computer that is not busy
        self.assertFalse(answer.HasField("not_durable"), answer)
        self.assertFalse(answer.HasField("not_shared"), answer)
        self.assertEqual([r.axis for r in answer.machines[0].response.results], ["spinner"])
        for machine in self.presses:
            machine.sim.wait_rest()
            self.assertTrue(machine.client.info().inhibited)
        for entrance in self.entrances:
            wait_for(lambda e=entrance: [latch.reason for latch in e.get().stop_all] == ["somebody shouted"],
                     "each entrance knows of it")

    def test_entrances_that_hear_of_it_do_not_tell_everybody_once_more(self):
        """Else a cell of 100 machines sends 10,000 of them."""
        self.cell()
        self.entrances[0].stop_all()
        for entrance in self.entrances:
            wait_for(lambda e=entrance: e.get().stop_all, "each entrance knows of it")
        time.sleep(2.5)  # longer than any entrance takes to ask a machine
        times = [machine.daemon.log().count("stop_all of 1 axes") for machine in self.presses]
        self.assertTrue(all(times), times)
        # By the entrance that was asked, and by the one beside it. Whoever asked a machine right before may be one more.
        self.assertLess(sum(times), 9, times)

    def test_a_dead_machine_is_named_and_latched_when_it_comes_back(self):
        self.cell()
        self.presses[2].daemon.kill()
        self.entrances[2].kill()
        self.entrances[0].wait_for_state("press-3", SILENT)
        answer = self.entrances[0].stop_all()
        self.assertEqual(self.outcomes(answer), {"press-1": DONE, "press-2": DONE, "press-3": GONE_SILENT})
        self.assertIn("press-3", answer.machines[2].error.message)
        self.presses[2].start_daemon()
        wait_for(lambda: self.presses[2].client.info().inhibited, "press-3 is latched")
        detail = self.refused("FAILED_PRECONDITION", "INHIBITED", self.presses[2].client.motion, "MoveRelative",
                              "spinner", distance=1.0, velocity=1.0)
        self.assertTrue(detail.remedy)
        self.assertEqual(self.presses[2].sim.shaft().starts, 0)
        # By whichever entrance saw it first.
        wait_for(lambda: cell_pb.CELL_EVENT_KIND_STOP_ALL_TOLD in [
            event.kind for entrance in self.entrances[:2] for event in entrance.events()], "the event of it")

    def test_release_is_for_all_and_says_who_was_not_there(self):
        self.cell()
        self.entrances[1].stop_all()
        self.presses[2].daemon.kill()
        self.entrances[0].wait_for_state("press-3", SILENT)
        wait_for(lambda: self.entrances[0].get().stop_all, "the other entrance knows of it")
        answer = self.entrances[0].release()
        self.assertEqual(self.outcomes(answer), {"press-1": DONE, "press-2": DONE, "press-3": GONE_SILENT})
        self.assertEqual(len(answer.released), 1)
        for entrance in self.entrances:
            wait_for(lambda e=entrance: not e.get().stop_all, "each entrance knows that it is over")
        time.sleep(2.5)  # longer than any entrance takes to ask a machine
        for machine in self.presses[:2]:
            self.assertFalse(machine.client.info().inhibited)
            machine.client.to_done("Enable", "spinner")
        self.presses[2].start_daemon()
        self.entrances[0].wait_for_state("press-3", PRESENT)
        self.assertTrue(self.presses[2].client.info().inhibited, "its own latch stays until it is released there")

    def test_without_etcd_and_over_restarts(self):
        self.cell()
        self.store.kill()
        answer = self.entrances[0].stop_all("no etcd")
        self.assertEqual(set(self.outcomes(answer).values()), {DONE})
        self.assertTrue(answer.HasField("not_shared"))
        for entrance in self.entrances:  # they tell each other
            wait_for(lambda e=entrance: e.get().stop_all, "each entrance knows of it")
        for entrance in self.entrances:
            entrance.kill()
            entrance.start()
            self.assertEqual([latch.reason for latch in entrance.get().stop_all], ["no etcd"])
        for index in range(self.store.members):
            self.store.start_member(index)
        wait_for(lambda: b"no etcd" in self.store.value("stop_all"), "etcd has it now")

    def test_a_new_entrance_finds_it_in_etcd(self):
        self.cell(1)
        self.entrances[0].stop_all("before")
        late = self.press(2)
        self.turning(late)
        entrance = self.entrance(late, self.store)
        wait_for(lambda: entrance.get().stop_all, "it has read it")
        wait_for(lambda: late.client.info().inhibited, "it is latched")
        late.sim.wait_rest()

    def test_one_machine_that_is_released_by_itself_stays_so(self):
        self.cell(2)
        self.entrances[0].stop_all()
        other = self.presses[1].client
        wait_for(lambda: self.entrances[1].get().stop_all, "the other entrance knows of it")
        time.sleep(2)  # and has told everybody whom it sees
        other.call(other.system.ReleaseStopAll, system_pb.ReleaseStopAllRequest())
        time.sleep(3)
        self.assertFalse(other.info().inhibited)
        self.presses[1].daemon.kill()
        self.presses[1].start_daemon()
        wait_for(lambda: self.presses[1].client.info().inhibited, "another run of its axisd: it is told again")

    def test_a_damaged_file_of_it_is_told(self):
        self.cell(1)
        here = self.entrances[0]
        here.stop_all()
        self.store.kill()
        here.kill()
        file = pathlib.Path(here.state) / "stop_all"
        file.write_bytes(b"garbage")
        here.start()
        self.assertIn("damaged", here.get().not_durable.message)

    def test_motion_before_it_never_follows_it(self):
        self.cell(2)
        machine = self.presses[1]
        machine.client.to_done("Enable", "spinner")
        here = self.entrances[0]
        self.assertEqual(self.outcomes(here.stop_all())["press-2"], DONE)
        starts = machine.sim.shaft().starts
        for index in range(20):
            with self.assertRaises(CallFailed):
                here.at("press-2", here.client.axis.MoveRelative, axis_pb.MoveRelativeRequest(
                    axis="spinner", distance=1.0, velocity=1.0, options={"request_id": f"no-{index}"}))
        self.assertEqual(machine.sim.shaft().starts, starts)
        self.assertEqual(machine.client.state("spinner").state in (pb.STATE_STANDSTILL, pb.STATE_DISABLED), True)


if __name__ == "__main__":
    unittest.main()
