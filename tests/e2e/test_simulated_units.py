"""A drive that its data sheet makes counts what `drive:` says, where the sheet does not tell it; `simulate:` has it otherwise."""
import re
import unittest

from harness import ROOT, Axis, Scenario, pb

SHEET = ROOT / "config" / "examples" / "standard-drive.eds"
TRAVEL = 30  # mm


class SimulatedUnits(Scenario):
    def online(self, units, simulated=""):
        axis = Axis(5, "can0", model="cia402", unit="mm", scale="{ microstep: 65536 pulses/rev, travel: 10 mm/rev }",
                    limits="{ velocity: 100 mm/s, acceleration_time: 150 ms }",
                    drive=f"{{ eds: {SHEET}, {units} }}", simulate=f"{{ start_position: 0{simulated} }}")
        machine = self.machine({"slide": axis}, networks={"can0": {"interface": "sim", "sdo_timeout": "500 ms"}})
        machine.start_daemon()
        machine.client.wait_online("slide")
        return machine

    def load(self, machine):
        text = machine.axisctl("sim", "show", "slide").stdout
        return float(re.search(r"the load is at (-?[\d.]+) mm", text)[1])

    def test_what_the_sheet_does_not_tell_is_as_drive_says(self):
        for units in ("velocity_unit: rpm", "velocity_unit: 0.001rev_per_second, acceleration_unit: rev_per_second",
                      "velocity_unit: 0.1degrees_per_second", "velocity_unit: 0.01radians_per_second",
                      "velocity_unit: rpm, acceleration_unit: pulses_per_second"):
            with self.subTest(units):
                machine = self.online(units)
                machine.client.to_done("Enable", "slide")
                machine.client.to_done("MoveRelative", "slide", distance=TRAVEL)
                self.assertAlmostEqual(self.load(machine), TRAVEL, delta=0.1)

    def test_a_wrong_key_can_be_practised(self):
        """The drive counts r/min, and is told pulses per second: the first fast motion shows it."""
        machine = self.online("velocity_unit: pulses_per_second", ", velocity_unit: 0.1rpm")
        client = machine.client
        client.to_done("Enable", "slide")
        ended = client.wait_ended(client.motion("MoveRelative", "slide", distance=TRAVEL))
        self.assertEqual(ended.state, pb.COMMAND_STATE_ERROR, ended)


if __name__ == "__main__":
    unittest.main()
