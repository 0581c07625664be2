"""A relative move goes as far as was asked, however the shaft was turned since the last motion."""
import unittest

from harness import Axis, Scenario, pb

PULSES = 800  # per mm
WINDOW = 12  # pulses: the in-position window of these drives, and what their encoders waver by


def table(model, **keys):
    return Axis(model=model, unit="mm", scale="{ microstep: 4000 pulses/rev, travel: 5 mm/rev }",
                limits="{ position: [0, 400], velocity: 50 mm/s, acceleration_time: 150 ms }",
                **({"drive": "{ released_position: counted }"} if model != "ykd2405pr" else {}), **keys)


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

    def test_ykd2405pr(self):
        """Open loop: the drive does not see that it was turned, and goes as far as it is told from where it is."""
        machine = self.machine({"table": table("ykd2405pr")}).start()
        client = machine.client
        for turned in (150, -120, -0.5):
            machine.sim.control(f"push 1 {int(turned * PULSES)}")
            client.to_done("Enable", "table")
            client.to_done("SetPosition", "table", position=200.0)  # refused while it can be turned unseen
            self.assertEqual(self.travel(machine, "move", "table", "1mm", "--relative"), 1)
            self.assertEqual(self.travel(machine, "move", "table", "-2mm", "--relative"), -2)
            client.to_done("Disable", "table")

    def test_a_jog_goes_no_further_than_its_travel(self):
        """From where the shaft is, which nobody knows, however far it was turned since the last one."""
        for model in ("ess42-r", "ssd2608pr", "ykd2405pr"):
            with self.subTest(model=model):
                machine = self.machine({"table": table(model, jog_travel="10 mm")}).start()
                client = machine.client
                for turned, direction in ((150, 1), (-120, 1), (30, -1)):
                    self.assertEqual(client.state("table").trust, pb.POSITION_TRUST_UNKNOWN)
                    machine.sim.control(f"push 1 {turned * PULSES}")
                    client.to_done("Enable", "table")
                    before = machine.sim.shaft().position
                    jog = client.motion("Jog", "table", velocity=40.0 * direction, hold=2.0)
                    self.assert_command(client.wait_ended(jog), "DONE")
                    machine.sim.wait_rest()
                    travelled = (machine.sim.shaft().position - before) / PULSES * direction
                    self.assertLessEqual(travelled, 10 + WINDOW / PULSES)
                    self.assertGreater(travelled, 5)
                    client.to_done("Disable", "table")


if __name__ == "__main__":
    unittest.main()
