"""axisctl commission with an operator who answers, and whose hand is at the simulated switches."""
import json
import pathlib
import re
import signal
import subprocess
import threading
import time
import unittest

from harness import AXISCTL, ENABLE, HOMING, START, STOP, Scenario, feeder, pb, wait_for
from harness.operator import Hand, ScriptedOperator

#: Quicker than the default.
QUICK = ("--velocity", "20mm/s", "--distance", "5mm")


class Commission(Scenario):
    def cell(self, **keys):
        """The feeder stands 10 mm from its home switch; nothing is enabled."""
        return self.machine({"feeder": feeder(**keys)}).start()

    def person(self, machine, *rules, options=QUICK, hand=None):
        """An operator who says yes and does what is asked for, but for `rules`."""
        return ScriptedOperator(machine, "feeder", [*rules, *(hand or Hand(machine)).rules()], options)

    def assert_verdicts(self, person, **expected):
        """Of these steps, with _ for the blanks in their names."""
        verdicts = {name.replace(" ", "_"): verdict for name, verdict in person.verdicts().items()}
        self.assertEqual({name: verdicts.get(name) for name in expected}, expected, person.text)

    def nothing_moved(self, machine):
        self.assertEqual(machine.sim.shaft(), (0, False, 0))
        for address in (START, HOMING):
            self.assertEqual(machine.wire.writes(address), [])

    def leases(self, machine):
        return json.loads(machine.axisctl("--json", "lease", "list").stdout)["leases"]

    def test_everything_passes(self):
        machine = self.cell()
        person = self.person(machine)
        self.assertEqual(person.finish(), 0, person.text)
        self.assert_verdicts(person, identity="PASSED", power_off="NOT_APPLICABLE", switch_X0="PASSED", switch_X1="PASSED",
                             switch_X2="PASSED", power_on="PASSED", jog_positive="PASSED", jog_negative="PASSED",
                             limit_positive="PASSED", limit_negative="PASSED", stop="PASSED", homing="PASSED",
                             soft_limits="PASSED", power_off_again="PASSED")
        record = person.record()
        config = json.loads(machine.axisctl("--json", "config", "show").stdout)
        self.assertEqual((record["verdict"], record["machine"], record["axis"], record["operator"], record["model"]),
                         ("VERDICT_PASSED", "e2e", "feeder", "e2e", "ykd2405pr"))
        self.assertEqual(record["configuration_revision"], config["revision"])
        self.assertEqual(len(person.step("switch X0")["edges"]), 2)
        figures = {figure["name"]: figure["value"] for figure in person.step("jog positive")["figures"]}
        self.assertEqual((figures["asked"], figures["travelled"]), (5, 5))
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

    def test_other_models_and_a_motor_the_other_way_round_pass(self):
        for keys in ({"model": "ssd2608pr"}, {"model": "ess42-r"},
                     {"scale": "{ microstep: 10000 pulses/rev, travel: 5 mm/rev, invert: true }",
                      "simulated": "home=20000:28000"}):
            with self.subTest(**keys):
                machine = self.cell(**keys)
                person = self.person(machine)
                self.assertEqual(person.finish(), 0, person.text)
                self.assertEqual(person.record()["verdict"], "VERDICT_PASSED")

    def test_a_limit_switch_on_the_wrong_side_is_named(self):
        """Swapped after the switches were looked at by hand, where each answered to its name."""
        machine = self.cell()
        swapped = Hand(machine, reacts={"X1": "X2"})
        person = self.person(machine, (r"Go to the switch at (X1) [^\]]*\] ", swapped.to_the_switch),
                             (r"--- limit negative\n", lambda _: machine.sim.control("input 1 X2 auto") or None),
                             options=("--velocity", "20mm/s", "--distance", "2mm"))
        self.assertEqual(person.finish(), 1, person.text)
        self.assert_verdicts(person, switch_X1="PASSED", limit_positive="FAILED", homing="NOT_DONE")
        self.assertEqual(person.step("limit positive")["reason"],
                         "X2 (negative_limit) became active on the way, not X1 (positive_limit): swapped?")

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
        seen = []

        def forget_once(match):
            seen.append(match[0])
            return None if len(seen) == 1 else Hand(machine).press(match)
        person = self.person(machine, (r"Actuate (X0) ", forget_once), (r"again/go-on/abort\] ", "again"),
                             (r"Actuate X1 ", "abort"), options=("--patience", "500ms"))
        self.assertEqual(person.finish(), 1, person.text)
        self.assertIn("no terminal changed", person.text)
        self.assertEqual((person.step("switch X0")["verdict"], person.step("switch X0")["attempts"]), ("VERDICT_PASSED", 2))
        self.assertIn("aborted by the operator", person.record()["ended_early"])

    def test_the_wrong_direction_ends_what_relies_on_it(self):
        machine = self.cell()
        person = self.person(machine, (r"in the positive direction\? [^\]]*\] ", "no"), (r"What did it do[^\]]*\] ", "o"))
        self.assertEqual(person.finish(), 1, person.text)
        self.assert_verdicts(person, jog_positive="FAILED", limit_positive="NOT_DONE", limit_negative="NOT_DONE",
                             stop="NOT_DONE", homing="NOT_DONE")
        self.assertEqual(person.step("jog positive")["remedy"], "axes.feeder.scale: { invert: true }")
        self.assertEqual(machine.sim.shaft().starts, 2)

    def stop_step(self, go, **keys):
        """Why the stop failed, where an operator does `go` once the motion that is to be stopped is permitted."""
        machine = self.cell(**keys)

        def permit(_match):
            go(machine)
            return "yes"
        person = self.person(machine, (r"about a third of it[^\]]*\] ", permit),
                             (r"(Actuate|Go to the switch)[^\]]*(\] |abort\)\n)", "skip"))
        self.assertEqual(person.finish(), 1, person.text)
        self.assert_verdicts(person, jog_positive="PASSED", limit_positive="SKIPPED", stop="FAILED", homing="NOT_DONE")
        self.assertEqual(person.step("limit positive")["reason"], "no time")
        return person.step("stop")["reason"]

    def test_a_stop_that_is_not_confirmed_fails(self):
        """The cable is cut in mid-move."""
        def cut(machine):
            def later():
                machine.sim.wait_moving()
                machine.sim.control("cut")
            threading.Thread(target=later).start()
        self.assertIn("standstill is not confirmed", self.stop_step(cut))

    def test_a_stop_that_ends_nothing_fails(self):
        def deafen(machine):
            machine.sim.control(f"fault drop_request register={STOP} count=-1")
        self.assertIn("it went on to its target", self.stop_step(deafen))

    def test_no_means_that_nothing_moves(self):
        """Not the power stage, and with power no motion: an empty answer, and one that begins with yes in mind."""
        machine = self.cell()
        person = self.person(machine, (r"Switch it on\? [^\]]*\] ", "no"))
        self.assertEqual(person.finish(), 1, person.text)
        self.assert_verdicts(person, switch_X0="PASSED", power_on="SKIPPED", jog_positive="NOT_DONE", stop="NOT_DONE")
        self.nothing_moved(machine)
        self.assertEqual(machine.wire.writes(ENABLE), [])

    def test_no_before_each_motion(self):
        machine = self.cell()
        answers = iter(["", "no"])
        person = self.person(machine, (r"Move\? [^\]]*\] ", lambda _: next(answers)), (r"Actuate ", "skip"))
        self.assertEqual(person.finish(), 1, person.text)
        self.assert_verdicts(person, switch_X0="SKIPPED", power_on="PASSED", jog_positive="SKIPPED", jog_negative="SKIPPED",
                             limit_positive="NOT_DONE", stop="NOT_DONE", homing="NOT_DONE", power_off_again="PASSED")
        self.nothing_moved(machine)

    def test_no_before_each_later_motion(self):
        machine = self.cell()
        person = self.person(machine, (r"Actuate ", "skip"), (r"(Go to the switch|a third|It homes)[^\]]*\] ", "no"))
        self.assertEqual(person.finish(), 1, person.text)
        self.assert_verdicts(person, jog_positive="PASSED", jog_negative="PASSED", limit_positive="SKIPPED",
                             limit_negative="SKIPPED", stop="SKIPPED", homing="SKIPPED")
        self.assertEqual((machine.sim.shaft(), machine.wire.writes(HOMING)), ((0, False, 2), []))

    def test_a_pipe_is_nobody(self):
        machine = self.cell()
        path = machine.path("piped.json")
        done = subprocess.run([AXISCTL, "--server", f"unix:{machine.socket}", "--json", "commission", "feeder",
                               "--record", path], input="yes\n" * 100, capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual(done.returncode, 1, done)
        record = json.loads(done.stdout)
        self.assertEqual(record, json.loads(pathlib.Path(path).read_text()))
        self.assertEqual(record["steps"][0]["verdict"], "VERDICT_SKIPPED")
        self.assertIn("nobody answered", record["steps"][0]["reason"])
        self.nothing_moved(machine)
        self.assertEqual(machine.wire.writes(ENABLE), [])

    def jog(self, machine, then, options=("--velocity", "5mm/s", "--distance", "20mm")):
        """An operator who does `then` while the axis jogs."""
        def act(_match):
            def later():
                machine.sim.wait_moving()
                wait_for(lambda: machine.sim.shaft().position > 1000, "in mid-move")
                then(person)
            threading.Thread(target=later).start()
            return "yes"
        person = self.person(machine, (r"Move\? [^\]]*\] ", act), (r"Actuate ", "skip"), options=options)
        return person

    def test_control_c_stops_a_jog(self):
        machine = self.cell()
        person = self.jog(machine, lambda person: person.interrupt())
        self.assertEqual(person.finish(), 130, person.text)
        shaft = machine.sim.shaft()
        self.assertFalse(shaft.moving)
        self.assertTrue(1000 < shaft.position < 30000, shaft)
        self.assertTrue(machine.wire.writes(STOP, 0))
        record = person.record()
        self.assertIn("interrupted; standstill is confirmed", record["ended_early"])
        self.assertIn("axisctl disable feeder", record["ended_early"])
        self.assert_verdicts(person, power_on="PASSED", jog_positive="NOT_DONE", stop="OPEN")
        self.assertEqual(self.leases(machine), [])

    def test_the_end_of_the_terminal_stops_a_jog(self):
        machine = self.cell()
        person = self.jog(machine, lambda person: person.process.send_signal(signal.SIGHUP))
        self.assertEqual(person.finish(), 130, person.text)
        self.assertLess(machine.sim.shaft().position, 30000)
        self.assertIn("standstill is confirmed", person.record()["ended_early"])

    def test_what_was_typed_before_a_question_is_no_answer(self):
        machine = self.cell()

        def decline(_match):
            time.sleep(0.5)
            return "no"
        person = self.person(machine, (r"in the positive direction\? [^\]]*\] ", "yes\nyes\nyes"),
                             (r"moves -5 mm[^?]*\? [^\]]*\] ", decline), (r"(Go to the switch|a third)[^\]]*\] ", "abort"))
        self.assertEqual(person.finish(), 1, person.text)
        self.assert_verdicts(person, jog_positive="PASSED", jog_negative="SKIPPED")
        self.assertEqual(machine.sim.shaft().starts, 1)

    def test_enter_stops_a_jog(self):
        machine = self.cell()
        person = self.jog(machine, lambda person: person.type(""))
        self.assertEqual(person.finish(), 1, person.text)
        self.assertLess(machine.sim.shaft().position, 30000)
        self.assert_verdicts(person, jog_positive="FAILED", jog_negative="FAILED", stop="NOT_DONE")
        self.assertEqual(person.step("jog positive")["reason"], "stopped by the operator")

    def test_if_it_is_killed_the_axis_halts_and_the_record_is_there(self):
        machine = self.cell()
        person = self.jog(machine, lambda person: person.process.kill())
        self.assertEqual(person.finish(), -signal.SIGKILL, person.text)
        machine.sim.wait_rest()
        self.assertLess(machine.sim.shaft().position, 38000)  # the lease of 2 s ended it
        self.assert_verdicts(person, power_on="PASSED", jog_positive="OPEN")

    def test_an_axis_with_a_fault_says_what_to_do(self):
        machine = self.cell()
        machine.sim.control("alarm 1 1")
        machine.client.wait_state("feeder", lambda s: s.state == pb.STATE_ERROR_STOP, "the alarm is seen")
        person = self.person(machine)
        self.assertEqual(person.finish(), 1, person.text)
        step = person.step("identity")
        self.assertEqual(step["verdict"], "VERDICT_FAILED")
        self.assertIn("overcurrent", step["reason"])
        self.assertTrue(step["remedy"], step)
        self.assertIn("fault", person.text)

    def test_an_axis_that_is_offline_says_what_to_do(self):
        machine = self.cell()
        machine.sim.control("power 1 off")
        machine.client.wait_state("feeder", lambda s: s.link == pb.LINK_STATE_OFFLINE, "offline")
        person = self.person(machine)
        self.assertEqual(person.finish(), 1, person.text)
        step = person.step("identity")
        self.assertEqual(step["verdict"], "VERDICT_FAILED")
        self.assertIn("offline", step["reason"])
        self.assertIn("check power and wiring", step["remedy"])
        self.assert_verdicts(person, switch_X0="NOT_DONE", power_on="NOT_DONE", jog_positive="NOT_DONE")

    def test_an_axis_of_somebody_else_is_left_alone(self):
        """Ctrl-C stops nothing that this did not begin."""
        machine = self.ready_feeder()
        done = machine.axisctl("lease", "acquire", "feeder", "--ttl", "60s", "--label", "press line")
        self.assertEqual(done.returncode, 0, done)
        move = self.move_under_way(machine, velocity=20.0, options={"lease_token": int(done.stdout)})
        since = time.monotonic_ns()
        person = self.person(machine, (r"again/go-on/abort\] ", lambda _: person.interrupt()))
        self.assertEqual(person.finish(), 130, person.text)
        self.assert_verdicts(person, identity="FAILED", switch_X0="OPEN")
        self.assertIn("press line", person.step("identity")["reason"])
        self.assert_command(machine.client.get_command(move), "ACTIVE")
        self.assertEqual(machine.wire.writes(STOP, since=since), [])

    def test_a_lease_that_is_taken_ends_it(self):
        """Also while hands are at the switches: somebody else may enable the axis then."""
        machine = self.cell()

        def take(_match):
            done = machine.axisctl("lease", "acquire", "feeder", "--take")
            self.assertEqual(done.returncode, 0, done)
        person = self.person(machine, (r"Actuate X1 ", take))
        self.assertEqual(person.finish(), 1, person.text)
        self.assertIn("the lease is over", person.record()["ended_early"])
        self.assert_verdicts(person, switch_X0="PASSED", switch_X1="NOT_DONE", power_on="OPEN")

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
