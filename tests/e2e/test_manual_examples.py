"""The two application examples of the YKD2405PR's manual (6.2.5), through the API."""
import unittest

from harness import BLOCK, START, STARTED, Scenario, spinner

#: Current 2.3 A, lock current half, 1000 pulses/rev, initial speed 10 r/min, times 100 ms, 500 r/min.
EXAMPLE = {"limits": "{ velocity: 10 rev/s, acceleration_time: 100 ms, start_speed: 10 r/min }",
           "drive": "{ current: 2.3A, lock_current: half }"}
VELOCITY = 500 / 60


class Examples(Scenario):
    def registers_at_start(self, machine):
        """The drive's registers at its start command: as commissioned, then every write before that command."""
        (start,) = machine.sim.wire.writes(START)
        registers = dict(self.before)
        for frame in machine.sim.wire.requests(until=start.time):
            if frame.is_write:
                registers.update(enumerate(frame.values, frame.address))
        return registers, start

    def example(self):
        # A drive that is commissioned otherwise, so that each value of the example has to be written.
        machine = self.machine({"motor": spinner(simulated="eeprom.0x0010=1,eeprom.0x0011=3,eeprom.0x0012=1", **EXAMPLE)})
        machine.start_lines()
        self.before = {address: machine.sim.peek(address) for address in (0x10, 0x11, 0x12, *range(0x20, 0x26))}
        self.assertEqual((self.before[0x10], self.before[0x11], self.before[0x12]), (1, 3, 1))
        machine.start_daemon()
        machine.client.wait_online("motor")
        machine.client.to_done("Enable", "motor")
        return machine

    def test_position_mode(self):
        machine = self.example()
        machine.client.to_done("MoveRelative", "motor", distance=1.0, velocity=VELOCITY)
        registers, start = self.registers_at_start(machine)
        self.assertEqual([registers[a] for a in (0x10, 0x11, 0x12)], [6, 8, 0])
        self.assertEqual([registers[a] for a in range(0x20, 0x26)], [10, 100, 100, 500, 0, 1000])
        # Step 3 is the manual's frame to the byte. The start is absolute (M8), from position 0.
        (block,) = machine.wire.writes(BLOCK, since=self.last_configuration(machine), until=start.time)
        self.assertEqual(block.data.hex(" ").upper(), "01 10 00 20 00 06 0C 00 0A 00 64 00 64 01 F4 00 00 03 E8 3D 69")
        self.assertEqual(start.values, [5])
        self.assertEqual(machine.sim.shaft().position, 1000)

    def last_configuration(self, machine):
        """When the axis was enabled."""
        (enable,) = machine.wire.writes(0x0029)
        return enable.time

    def test_speed_mode(self):
        machine = self.example()
        machine.client.motion("MoveVelocity", "motor", velocity=VELOCITY, wait=STARTED)
        machine.client.wait_state("motor", lambda s: abs(s.velocity - VELOCITY) < 0.01, "500 r/min")
        registers, start = self.registers_at_start(machine)
        self.assertEqual([registers[a] for a in (0x10, 0x11, 0x12)], [6, 8, 0])
        self.assertEqual([registers[a] for a in range(0x20, 0x24)], [10, 100, 100, 500])
        self.assertEqual(start.data.hex(" ").upper(), "01 06 00 27 00 02 B8 00")
        self.assertEqual(machine.sim.peek(0x000C), 500)

    def test_speed_mode_backwards(self):
        machine = self.example()
        machine.client.motion("MoveVelocity", "motor", velocity=-VELOCITY, wait=STARTED)
        machine.client.wait_state("motor", lambda s: abs(s.velocity + VELOCITY) < 0.01, "-500 r/min")
        registers, _ = self.registers_at_start(machine)
        # The manual's own bytes say +500 for "backwards"; the table says that the sign gives the direction.
        self.assertEqual([registers[a] for a in range(0x20, 0x24)], [10, 100, 100, 0x10000 - 500])
        self.assertLess(machine.sim.shaft().position, 0)


if __name__ == "__main__":
    unittest.main()
