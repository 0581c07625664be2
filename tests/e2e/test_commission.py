"""axisctl commission with an operator who answers, and whose hand is at the simulated switches."""
import concurrent.futures
import json
import pathlib
import re
import unittest

from harness import BLOCK, HOMING, START, STOP, error_pb, pb, system_pb, wait_for
from harness.person import CommissionScenario, Hand, ScriptedOperator


class Commission(CommissionScenario):
    def test_everything_passes(self):
        machine = self.cell()
        person = self.person(machine)
        self.assertEqual(person.finish(), 0, person.text)
        self.assert_verdicts(person, identity="PASSED", power_off="NOT_APPLICABLE", switch_X0="PASSED", switch_X1="PASSED",
                             switch_X2="PASSED", power_on="PASSED", jog_positive="PASSED", jog_negative="PASSED",
                             limit_positive="PASSED", limit_negative="PASSED", stop="PASSED", homing="PASSED",
                             soft_limits="PASSED", start_in_one_frame="NOT_APPLICABLE", power_off_again="PASSED")
        record = person.record()
        config = json.loads(machine.axisctl("--json", "config", "show").stdout)
        self.assertEqual((record["verdict"], record["machine"], record["axis"], record["operator"], record["model"]),
                         ("VERDICT_PASSED", "e2e", "feeder", "e2e", "ykd2405pr"))
        self.assertEqual(record["configuration_revision"], config["revision"])
        self.assertEqual(len(person.step("switch X0")["edges"]), 2)
        figures = {figure["name"]: figure["value"] for figure in person.step("jog positive")["figures"]}
        self.assertEqual((figures["asked"], figures["travelled"]), (5, 5))
        # The first move lasts a second, and only what was measured is followed by faster ones.
        self.assertEqual((figures["velocity"], record["speed"]), (5, "SPEED_PROOF_PROVEN"))
        self.assertTrue(figures["time_at_least"] < figures["time_told"] * 1.05 + 0.05, figures)
        self.assertTrue(figures["time_at_most"] > figures["time_told"] * 0.95 - 0.05, figures)
        figures = {figure["name"]: figure["value"] for figure in person.step("jog negative")["figures"]}
        self.assertEqual((figures["velocity"], "time_told" in figures), (20, False))
        figures = {figure["name"]: figure["value"] for figure in person.step("stop")["figures"]}
        self.assertTrue(0 < figures["standstill_after"] < figures["published_bound"], figures)
        self.assertGreaterEqual(figures["call_answered_after"], figures["standstill_after"])
        self.assertTrue(0 < figures["way"] < figures["published_way"], figures)
        state = machine.client.state("feeder")
        self.assertEqual((state.enabled, state.lease_holder), (False, ""))
        # Power came on after the switches, and was permitted; each start was permitted just before it.
        self.assertLess(person.text.index("switch X2: passed"), person.text.index("Switch it on?"))
        asked = len(re.findall(r"(?:Move|Home)\? \[yes/skip/abort\] yes", person.text))
        self.assertEqual(len(machine.wire.writes(START)) + len(machine.wire.writes(HOMING)), asked)

    def jogs_in_one_frame(self, simulated):
        """Commissioned with starts in one frame, as far as the jogs."""
        machine = self.cell(drive="{ start_in_one_frame: true }", simulated=simulated)
        person = self.person(machine, (r"Actuate ", "skip"), (r"Go to the switch [^\]]*\] ", "abort"))
        person.finish()
        return machine, person, [frame for frame in machine.wire.writes(START) if frame.address == BLOCK]

    def test_a_drive_that_starts_in_one_frame_keeps_its_key(self):
        machine, person, starts = self.jogs_in_one_frame("home=-28000:-20000")
        self.assert_verdicts(person, jog_positive="PASSED", jog_negative="PASSED", start_in_one_frame="PASSED")
        self.assertIn("axes.feeder.drive.start_in_one_frame stays true", person.step("start in one frame")["reason"])
        self.assertEqual(len(starts), 2, "both jogs")
        self.assertEqual(machine.sim.shaft().starts, 2)

    def test_a_drive_that_takes_no_start_in_one_frame_says_so_and_stays(self):
        for refused in ("off", "on"):
            machine, person, starts = self.jogs_in_one_frame(
                f"home=-28000:-20000,switch.one_frame_start=off,switch.one_frame_start_refused={refused}")
            self.assert_verdicts(person, jog_positive="FAILED", start_in_one_frame="NOT_DONE", stop="NOT_DONE",
                                 power_off_again="PASSED")
            step = person.step("jog positive")
            self.assertIn("the drive does not start in one frame", step["reason"])
            self.assertIn("remove axes.feeder.drive.start_in_one_frame", step["remedy"])
            self.assertEqual(machine.sim.shaft(), (0, False, 0), person.text)
            self.assertGreaterEqual(len(starts), 1)

    def test_other_models_and_a_motor_the_other_way_round_pass(self):
        people = [self.person(self.cell(**keys)) for keys in (
            {"model": "ssd2608pr"}, {"model": "ess42-r"},
            {"scale": "{ microstep: 10000 pulses/rev, travel: 5 mm/rev, invert: true }", "simulated": "home=20000:28000"})]
        with concurrent.futures.ThreadPoolExecutor() as threads:  # side by side: most of it is waiting
            ends = list(threads.map(ScriptedOperator.finish, people))
        for person, end in zip(people, ends):
            self.assertEqual((end, person.record()["verdict"]), (0, "VERDICT_PASSED"), person.text)

    def test_a_limit_switch_on_the_wrong_side_is_named(self):
        """Swapped after the switches were looked at by hand, where each answered to its name: the drive would go on."""
        machine = self.cell()
        swapped = Hand(machine, reacts={"X1": "X2"})
        person = self.person(machine, (r"Go to the switch at (X1) [^\]]*\] ", swapped.to_the_switch),
                             (r"--- limit negative\n", lambda _: machine.sim.control("input 1 X2 auto") or None),
                             (r"Actuate (X0|X2) ", "skip"))
        self.assertEqual(person.finish(), 1, person.text)
        self.assert_verdicts(person, switch_X1="PASSED", limit_positive="FAILED", homing="NOT_DONE")
        step = person.step("limit positive")
        self.assertEqual(step["reason"], "X2 (negative_limit) became active on the way, not X1 (positive_limit): swapped?")
        self.assertEqual([command["state"] for command in step["commands"]],
                         ["COMMAND_STATE_ABORTED", "COMMAND_STATE_DONE"])
        self.assertTrue(machine.wire.writes(STOP, 0))

    def test_an_output_that_changes_on_the_way_is_no_limit_switch(self):
        machine = self.cell(outputs="{ Y1: in_position }")
        person = self.person(machine, (r"Go to the switch at X1 [^\]]*\] ", "yes"), (r"Go to the switch at X2 [^\]]*\] ", "abort"),
                             (r"Actuate ", "skip"))
        self.assertEqual(person.finish(), 1, person.text)
        step = person.step("limit positive")
        self.assertEqual((step["verdict"], step["reason"]),
                         ("VERDICT_FAILED", "X1 (positive_limit) did not become active on the way"))
        self.assertEqual(step.get("edges", []), [])

    def test_a_wrong_polarity_is_told_with_its_key(self):
        # A switch that closes when it is actuated, and a configuration that says the contrary.
        machine = self.cell(inputs="{ X0: home, X1: { function: positive_limit, active: low } }",
                            simulated="home=-28000:-20000,positive_limit=900000,wire.X1=positive_limit")
        person = self.person(machine, (r"X1 \(positive_limit\) is active now\.[^\]]*\] ", "no"))
        self.assertEqual(person.finish(), 1, person.text)
        self.assert_verdicts(person, switch_X0="PASSED", switch_X1="FAILED", limit_positive="NOT_DONE", stop="NOT_DONE",
                             homing="NOT_DONE", power_off_again="PASSED")
        step = person.step("switch X1")
        self.assertIn("polarity (active: low) is wrong", step["reason"])
        self.assertEqual(step["remedy"], "axes.feeder.inputs.X1: { function: positive_limit, active: high }")

    def test_a_normally_closed_switch_is_right(self):
        """Closed at rest, and configured so."""
        inputs = "{ X0: { function: home, active: low } }"
        machine = self.cell(inputs=inputs, simulated="wire.X0=home:nc,home=-28000:-20000")
        hand = Hand(machine)
        rules = ((r"Actuate (X0) ", lambda _: machine.sim.control("input 1 X0 off")),)
        person = self.person(machine, *rules, (r"Switch it on\? [^\]]*\] ", "abort"), hand=hand)
        self.assertEqual(person.finish(), 1, person.text)
        self.assert_verdicts(person, switch_X0="PASSED", power_on="NOT_DONE")

    def test_swapped_switches_are_named(self):
        machine = self.cell()
        hand = Hand(machine, reacts={"X0": "X2", "X2": "X0"})
        person = self.person(machine, hand=hand)
        self.assertEqual(person.finish(), 1, person.text)
        self.assert_verdicts(person, switch_X0="FAILED", switch_X1="PASSED", switch_X2="FAILED", limit_positive="NOT_DONE",
                             limit_negative="NOT_DONE", stop="NOT_DONE", homing="NOT_DONE")
        self.assertEqual(person.step("switch X0")["reason"], "X2 (negative_limit) changed, expected X0 (home): swapped?")

    def test_a_step_that_failed_can_be_tried_again(self):
        machine = self.cell()
        tries = []

        def press_but_once(match):
            return Hand(machine).press(match) if tries else None

        def again(_match):
            tries.append("again")
            machine.sim.control("input 1 X0 auto")  # a computer that is busy may have seen the hand too late
            return "again"
        person = self.person(machine, (r"Actuate (X0) ", press_but_once), (r"again/go-on/abort\] ", again),
                             (r"Actuate X1 ", "abort"), options=("--patience", "1s"))
        self.assertEqual(person.finish(), 1, person.text)
        self.assertIn("no terminal changed", person.text)
        step = person.step("switch X0")
        self.assertEqual((step["verdict"], step["attempts"]), ("VERDICT_PASSED", 1 + len(tries)))
        self.assertIn("aborted by the operator", person.record()["ended_early"])

    def test_the_wrong_direction_ends_what_relies_on_it(self):
        machine = self.cell()
        person = self.person(machine, (r"in the positive direction\? [^\]]*\] ", "no"), (r"What did it do[^\]]*\] ", "o"),
                             (r"Actuate ", "skip"))
        self.assertEqual(person.finish(), 1, person.text)
        self.assert_verdicts(person, jog_positive="FAILED", limit_positive="NOT_DONE", limit_negative="NOT_DONE",
                             stop="NOT_DONE", homing="NOT_DONE")
        self.assertEqual(person.step("jog positive")["remedy"], "axes.feeder.scale: { invert: true }")
        self.assertEqual(machine.sim.shaft().starts, 2)

    def test_a_wrong_speed_ends_all_motion(self):
        """A motor that is a little slower than the drive tells it: nothing else would find that."""
        machine = self.cell()
        machine.sim.control("pace 1 60")
        person = self.person(machine, (r"Actuate ", "skip"))
        self.assertEqual(person.finish(), 1, person.text)
        self.assert_verdicts(person, power_on="PASSED", jog_positive="FAILED", jog_negative="NOT_DONE",
                             limit_positive="NOT_DONE", stop="NOT_DONE", homing="NOT_DONE", power_off_again="PASSED")
        step = person.step("jog positive")
        self.assertRegex(step["reason"], r"for 1\.\d+ s.*, and \d+.* were told for it at 5 mm/s: it is too slow")
        self.assertIn("axes.feeder.scale (microstep", step["remedy"])
        self.assertEqual(person.record()["speed"], "SPEED_PROOF_WRONG")
        self.assertEqual(machine.sim.shaft().starts, 1)

    def test_an_axis_with_a_fault_says_what_to_do(self):
        machine = self.cell()
        machine.sim.control("alarm 1 1")
        machine.client.wait_state("feeder", lambda s: s.state == pb.STATE_ERROR_STOP, "the alarm is seen")
        client = machine.client
        wait_for(lambda: all(o.detail.reason != error_pb.REASON_STOPPING for o in client.call(
            client.system.Explain, system_pb.ExplainRequest(axis="feeder")).obstacles), "the stop is confirmed")
        person = self.person(machine)
        self.assertEqual(person.finish(), 1, person.text)
        step = person.step("identity")
        self.assertEqual(step["verdict"], "VERDICT_FAILED")
        self.assertIn("overcurrent", step["reason"])
        self.assertTrue(step["remedy"], step)
        self.assertIn("fault", person.text)

    def test_an_axis_that_is_offline_says_what_to_do(self):
        machine = self.cell(turnaround_max="300 ms")
        machine.sim.control("power 1 off")
        machine.client.wait_state("feeder", lambda s: s.link == pb.LINK_STATE_OFFLINE, "offline")
        person = self.person(machine)
        self.assertEqual(person.finish(), 1, person.text)
        step = person.step("identity")
        self.assertEqual(step["verdict"], "VERDICT_FAILED")
        self.assertIn("offline", step["reason"])
        self.assertIn("check power", step["remedy"])
        self.assert_verdicts(person, switch_X0="NOT_DONE", power_on="NOT_DONE", jog_positive="NOT_DONE")

    def test_a_machine_that_is_stopped_says_what_to_do(self):
        machine = self.cell()
        machine.axisctl("stop", "--all")
        person = self.person(machine)
        self.assertEqual(person.finish(), 1, person.text)
        self.assertEqual(person.step("identity")["remedy"], "axisctl release-stop --all")
        self.nothing_moved(machine)

    def test_power_that_is_on_goes_off_before_hands_are_asked_for(self):
        machine = self.ready_feeder()
        person = self.person(machine, (r"Actuate ", "abort"))
        self.assertEqual(person.finish(), 1, person.text)
        self.assert_verdicts(person, power_off="PASSED", switch_X0="NOT_DONE")
        self.assertFalse(machine.client.state("feeder").enabled)

    def test_a_record_is_not_replaced(self):
        machine = self.cell()
        path = pathlib.Path(machine.path("record.json"))
        path.write_text("evidence")
        done = machine.axisctl("commission", "feeder", "--record", str(path))
        self.assertEqual((done.returncode, path.read_text()), (2, "evidence"), done)
        self.assertIn("cannot write", done.stderr)


if __name__ == "__main__":
    unittest.main()
