"""What ends a motion of axisctl commission, and what keeps one from beginning."""
import json
import pathlib
import signal
import subprocess
import threading
import time
import unittest

from harness import AXISCTL, ENABLE, HOMING, STOP, wait_for
from harness.person import CommissionScenario


class CommissionStops(CommissionScenario):
    def leases(self, machine):
        return json.loads(machine.axisctl("--json", "lease", "list").stdout)["leases"]

    def stop_step(self, go, **keys):
        """Why the stop failed, where an operator does `go` once the motion that is to be stopped is permitted."""
        machine = self.cell(**keys)

        def permit(_match):
            go(machine)
            return "yes"
        person = self.person(machine, (r"about a third of it[^\]]*\] ", permit),
                             (r"Actuate |Go to the switch[^\]]*\] ", "skip"))
        self.assertEqual(person.finish(), 1, person.text)
        self.assert_verdicts(person, jog_positive="PASSED", limit_positive="SKIPPED", stop="FAILED", homing="NOT_DONE")
        self.assertEqual(person.step("limit positive")["reason"], "no time")
        machine.sim.control("join")  # the daemon's end waits for a stop that it owes
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
        def deafen(machine):  # until the move is over: a stop without an answer is repeated after a second
            machine.sim.control(f"fault drop_request register={STOP} count=3")
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

    #: Of jog(), and where it would end: after 40 s, so that whatever ends it does so before.
    LONG, TARGET = ("--velocity", "5mm/s", "--distance", "200mm"), 400000

    def jog(self, machine, then, options=LONG):
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
        self.assertTrue(1000 < shaft.position < self.TARGET, shaft)
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
        self.assertLess(machine.sim.shaft().position, self.TARGET)
        self.assertIn("standstill is confirmed", person.record()["ended_early"])

    def test_what_was_typed_before_a_question_is_no_answer(self):
        machine = self.cell()

        person = self.person(machine, (r"in the positive direction\? [^\]]*\] ",
                                       lambda _: person.type_ahead("yes", "yes", "yes")),
                             (r"moves -5 mm[^?]*\? [^\]]*\] ", "no"), (r"Actuate ", "skip"),
                             (r"(Go to the switch|a third)[^\]]*\] ", "abort"))
        self.assertEqual(person.finish(), 1, person.text)
        self.assert_verdicts(person, jog_positive="PASSED", jog_negative="SKIPPED")
        self.assertEqual(machine.sim.shaft().starts, 1)

    def test_enter_stops_a_jog(self):
        machine = self.cell()
        person = self.jog(machine, lambda person: person.type(""))
        self.assertEqual(person.finish(), 1, person.text)
        self.assertLess(machine.sim.shaft().position, self.TARGET)
        self.assert_verdicts(person, jog_positive="FAILED", jog_negative="FAILED", stop="NOT_DONE")
        self.assertEqual(person.step("jog positive")["reason"], "stopped by the operator")

    def test_if_it_is_killed_the_axis_halts_and_the_record_is_there(self):
        machine = self.cell()
        person = self.jog(machine, lambda person: person.process.kill())
        self.assertEqual(person.finish(), -signal.SIGKILL, person.text)
        machine.sim.wait_rest()
        self.assertLess(machine.sim.shaft().position, self.TARGET)  # its lease ended it
        self.assert_verdicts(person, power_on="PASSED", jog_positive="OPEN")

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


if __name__ == "__main__":
    unittest.main()
