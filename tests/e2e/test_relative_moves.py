"""A relative move goes as far as was asked, however the shaft was turned since the last motion."""
import unittest

from harness import Axis, Scenario

PULSES = 800  # per mm
WINDOW = 12  # pulses: the in-position window of these drives, and what their encoders waver by


def table(model):
    return Axis(model=model, unit="mm", scale="{ microstep: 4000 pulses/rev, travel: 5 mm/rev }",
                limits="{ position: [0, 400], velocity: 50 mm/s, acceleration_time: 150 ms }",
                drive="{ released_position: counted }")


class TurnedByHand(Scenario):
    def travel(self, machine, *words):
        """By how many mm the load went while axisctl ran these words, which have to succeed."""
        before = machine.sim.shaft().position
        done = machine.axisctl(*words, "--wait")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        machine.sim.wait_rest()
        return (machine.sim.shaft().position - before) / PULSES

    def check(self, model):
        machine = self.machine({"table": table(model)}).start()
        client = machine.client
        client.to_done("SetPosition", "table", position=200.0)  # released, as it powered up
        for turned in (150, -120, -0.5):
            there = client.state("table").position + turned
            machine.sim.control(f"push 1 {int(turned * PULSES)}")
            client.wait_state("table", lambda s, there=there: abs(s.position - there) < 0.1, "it was turned")
            client.to_done("Enable", "table")
            self.assertAlmostEqual(self.travel(machine, "move", "table", "1mm", "--relative"), 1, delta=WINDOW / PULSES)
            self.assertAlmostEqual(self.travel(machine, "move", "table", "-2mm", "--relative"), -2,
                                   delta=WINDOW / PULSES)
            client.to_done("Disable", "table")

    def test_ess42_r(self):
        self.check("ess42-r")

    def test_ssd2608pr(self):
        self.check("ssd2608pr")


if __name__ == "__main__":
    unittest.main()
