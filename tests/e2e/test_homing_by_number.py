"""Homing by the number of a method in 6098h: the drive homes by itself, with whatever switches it has."""
import re
import unittest

from harness import ROOT, Axis, Scenario, pb
from harness.client import drive_pb

SHEET = ROOT / "config" / "examples" / "standard-drive.eds"
HOME_AT = 3  # mm: what the place is called
NEGATIVE, POSITIVE = -40, 300  # mm of the load: its limit switches


def slide(method, scale="", inputs="NEG: negative_limit, POS: positive_limit"):
    return Axis(5, "can0", model="cia402", unit="mm",
                scale=f"{{ microstep: 65536 pulses/rev, travel: 10 mm/rev{scale} }}",
                limits="{ velocity: 100 mm/s, acceleration_time: 150 ms }",
                homing=f"{{ method: {method}, velocity: 50 mm/s, search_velocity: 5 mm/s, position: {HOME_AT}, "
                       "timeout: 60 s }",
                inputs=f"{{ {inputs} }}",  # without them no switch is simulated
                drive=f"{{ eds: {SHEET}, velocity_unit: pulses_per_second }}",
                simulate=f"{{ negative_limit: {NEGATIVE} mm, positive_limit: {POSITIVE} mm }}")


class HomingByNumber(Scenario):
    def online(self, *arguments, **keys):
        machine = self.machine({"slide": slide(*arguments, **keys)},
                               networks={"can0": {"interface": "sim", "sdo_timeout": "500 ms"}})
        machine.start_daemon()
        machine.client.wait_online("slide")
        return machine

    def printed(self, machine, *words):
        done = machine.axisctl(*words)
        self.assertEqual(done.returncode, 0, done)
        return done.stdout

    def load(self, machine):
        """Where the load is (mm), and how often it was started."""
        text = self.printed(machine, "sim", "show", "slide")
        found = re.search(r"the load is at (-?[\d.]+) mm, at rest, (\d+) starts?", text)
        self.assertTrue(found, text)
        return float(found[1]), int(found[2])

    def homes(self, machine, at):
        client = machine.client
        client.to_done("Enable", "slide")
        client.to_done("Home", "slide")
        state = client.state("slide")
        self.assertEqual(state.trust, pb.POSITION_TRUST_HOMED, state)
        self.assertAlmostEqual(state.position, HOME_AT, delta=0.1)
        load, starts = self.load(machine)
        self.assertAlmostEqual(load, at, delta=0.5)
        return starts

    def moves_on(self, machine, at, starts):
        machine.client.to_done("MoveAbsolute", "slide", position=HOME_AT + 20)
        load, after = self.load(machine)
        self.assertAlmostEqual(load, at + 20, delta=0.5)
        self.assertEqual(after, starts + 1)

    def test_at_a_limit_switch(self):
        machine = self.online(17)
        self.moves_on(machine, NEGATIVE, self.homes(machine, at=NEGATIVE))

    def test_an_inverted_axis_homes_at_the_other_one(self):
        machine = self.online(17, scale=", invert: true", inputs="NEG: positive_limit, POS: negative_limit")
        self.moves_on(machine, NEGATIVE, self.homes(machine, at=NEGATIVE))

    def test_where_it_stands(self):
        machine = self.online(37)
        self.assertEqual(self.homes(machine, at=0), 0)
        self.moves_on(machine, 0, 0)

    def test_a_number_that_the_drive_does_not_have_moves_nothing(self):
        machine = self.online(33)
        machine.client.to_done("Enable", "slide")
        home = self.assert_command(machine.client.motion("Home", "slide", wait=pb.WAIT_UNTIL_DONE), "ERROR")
        self.assertEqual(home.cause.object, 0x609800)
        self.assertEqual(self.load(machine), (0, 0))
        self.assertEqual(machine.client.state("slide").trust, pb.POSITION_TRUST_UNKNOWN)

    def test_the_numbers_that_are_permitted_are_shown(self):
        machine = self.online(17)
        drive = machine.client.call(machine.client.drive.GetDrive, drive_pb.GetDriveRequest(axis="slide"))
        names, numbers = list(drive.homing_methods)[:4], list(drive.homing_methods)[4:]
        self.assertEqual(names, ["home_positive", "home_negative", "positive_limit", "negative_limit"])
        self.assertEqual(numbers, [str(number) for number in range(-128, 38) if number != 0])
        self.assertIn("negative_limit, -128 to -1, 1 to 37\n", self.printed(machine, "drive", "info", "slide"))


if __name__ == "__main__":
    unittest.main()
