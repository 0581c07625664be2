"""axisctl commission of a YSS-C, with a hand at its simulated switches."""
import unittest

from harness import CanScenario, turntable
from harness.person import Hand, ScriptedOperator


class CommissionOnCan(CanScenario):
    def table(self):
        """Stands 27 deg from its home switch; nothing is enabled."""
        axis = turntable(5, simulated="home=-4000:-3000", limits="{ position: [0, 300], velocity: 360 deg/s, "
                                                                "acceleration_time: 150 ms }",
                         homing="{ method: home_negative, velocity: 20 deg/s, search_velocity: 4 deg/s, backoff: 5 deg, "
                                "max_travel: 100 deg, timeout: 60 s }",
                         inputs="{ X0: home, X1: positive_limit, X2: { function: negative_limit, active: low } }",
                         jog_travel="40 deg")
        machine = self.idle_cell({"table": axis})
        machine.start_line("can0")
        machine.start_daemon()
        machine.client.wait_online("table")
        return machine

    def person(self, machine, *rules, hand=None):
        return ScriptedOperator(machine, "table", [*rules, *(hand or Hand(machine, node=5, low=("X2",))).rules()])

    def test_everything_passes(self):
        machine = self.table()
        person = self.person(machine)
        self.assertEqual(person.finish(), 0, person.text)
        verdicts = person.verdicts()
        self.assertEqual({name for name, verdict in verdicts.items() if verdict != "PASSED"},
                         {"power off", "start in one frame"}, person.text)
        self.assertEqual(len(verdicts), 15)
        figures = {figure["name"]: figure["value"] for figure in person.step("stop")["figures"]}
        self.assertTrue(0 < figures["standstill_after"] < figures["published_bound"], figures)
        self.assertFalse(machine.client.state("table").enabled)

    def test_no_before_each_motion(self):
        machine = self.table()
        person = self.person(machine, (r"Move\? [^\]]*\] ", "no"))
        self.assertEqual(person.finish(), 1, person.text)
        self.assertEqual(person.verdicts()["jog positive"], "SKIPPED")
        self.assertEqual(machine.sim.shaft(5)[1:], (False, 0))

    def test_control_c_stops_a_jog(self):
        machine = self.table()

        def go(_match):
            Hand(machine, node=5).once_under_way(person.interrupt)
            return "yes"
        person = self.person(machine, (r"Move\? [^\]]*\] ", go))
        self.assertEqual(person.finish(), 130, person.text)
        self.assertFalse(machine.sim.shaft(5).moving)
        self.assertIn("standstill is confirmed", person.record()["ended_early"])


if __name__ == "__main__":
    unittest.main()
