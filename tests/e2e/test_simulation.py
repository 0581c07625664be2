"""axisctl sim: hands, supplies and cables of the drives that the daemon simulates, on RS-485 and CAN."""
import json
import unittest

from harness import AXISCTL, Demo, Scenario, pb, run, wait_for


class Simulation(Scenario):
    def setUp(self):
        super().setUp()
        self.demo = Demo()
        self.addCleanup(self.demo.close)
        self.client = self.demo.client

    def axisctl(self, *words):
        return run([AXISCTL, "--server", self.demo.server, *words], limit=120)

    def sim(self, *words):
        done = self.axisctl("sim", *words)
        self.assertEqual(done.returncode, 0, done)
        return done.stdout

    def input_becomes(self, axis, terminal, active):
        self.client.wait_state(axis, lambda state: any(each.name == terminal and each.active == active
                                                       for each in state.inputs), f"{terminal} of {axis}: {active}")

    def test_a_hand_at_the_switches_whatever_their_level(self):
        self.client.wait_online("feeder")
        for terminal in ("X1", "X2"):  # X2 is active low
            self.input_becomes("feeder", terminal, False)
            self.sim("input", "feeder", terminal, "on")
            self.input_becomes("feeder", terminal, True)
            self.sim("input", "feeder", terminal, "auto")
            self.input_becomes("feeder", terminal, False)

    def test_an_alarm_and_the_way_out_of_it(self):
        self.client.wait_online("feeder")
        self.client.to_done("Enable", "feeder")
        self.sim("alarm", "feeder", "2")
        self.client.wait_state("feeder", lambda state: state.state == pb.STATE_ERROR_STOP, "the alarm")
        self.sim("alarm", "feeder", "0")
        self.client.wait_state("feeder", lambda state: state.alarm_code == 0, "the cause is gone")
        self.client.to_done("Reset", "feeder")

    def test_supplies_and_cables(self):
        for axis, off, on in (("carousel", ("power", "carousel", "off"), ("power", "carousel", "on")),
                              ("dial", ("power", "dial", "off"), ("power", "dial", "on")),
                              ("dial", ("cut", "line-b"), ("join", "line-b"))):
            self.client.wait_online(axis)
            self.sim(*off)
            self.client.wait_state(axis, lambda state: state.link == pb.LINK_STATE_OFFLINE, f"{axis} offline")
            self.sim(*on)
            self.client.wait_online(axis)

    def test_a_released_shaft_is_pushed_and_a_blocked_one_stays(self):
        self.client.wait_online("feeder")
        self.client.to_done("Disable", "feeder")
        self.assertIn("the load is at 50 mm, at rest, 0 starts", self.sim("show", "feeder"))
        self.sim("push", "feeder", "0.5cm")
        self.assertIn("the load is at 55 mm", self.sim("show", "feeder"))
        self.sim("block", "feeder", "on")
        refused = self.axisctl("--json", "sim", "push", "feeder", "5mm")
        self.assertEqual(refused.returncode, 4, refused)
        self.assertEqual(json.loads(refused.stderr)["error"]["message"], "feeder: the shaft is held")

    def test_lost_replies_are_asked_for_again(self):
        self.client.wait_online("turntable")
        self.sim("lose", "turntable", "2")

        def timeouts():
            buses = json.loads(self.axisctl("--json", "bus", "statistics", "line-a").stdout)["buses"]
            (node,) = (node for node in buses[0]["nodes"] if node["name"] == "turntable")
            return int(node["line"]["timeouts"]) >= 2
        wait_for(timeouts, "two lost replies")
        self.client.wait_online("turntable")

    def test_a_plc_picks_a_stop_of_the_pusher(self):
        """Its drive moves by itself, by the segment that its terminals select."""
        self.client.wait_online("pusher")
        self.client.to_done("Enable", "pusher")
        self.sim("input", "pusher", "X3", "on")
        self.sim("input", "pusher", "X2", "on")
        self.client.wait_state("pusher", lambda state: not state.moving and abs(state.position - 10) < 0.1, "segment 1")

    def test_names_are_checked(self):
        refused = self.axisctl("sim", "power", "fedeer", "off")
        self.assertEqual((refused.returncode, refused.stderr),
                         (4, "axisctl: fedeer: there is no axis 'fedeer'; did you mean 'feeder'?\n"))
        self.assertIn("there is no input X9; it has PU, DR, X0", self.axisctl("sim", "input", "feeder", "X9", "on").stderr)
        self.assertIn("there is no bus 'line-z'; name one of line-a", self.axisctl("sim", "cut", "line-z").stderr)
        self.assertIn("no such alarm; it has 1, ", self.axisctl("sim", "alarm", "feeder", "99").stderr)


if __name__ == "__main__":
    unittest.main()
