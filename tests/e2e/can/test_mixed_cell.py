"""Three RS-485 models and a YSS-C in one machine, driven by one program that does not know which is which."""
import unittest

from harness import CanScenario, bus_pb, feeder, pb, spinner, turntable


class MixedCell(CanScenario):
    def test_one_program_for_all(self):
        machine = self.idle_cell({"feeder": feeder(1), "lifter": feeder(2, model="ssd2608pr"),
                                  "mixer": spinner(3, model="ess42-r"), "table": turntable(5)}).start()
        states = machine.client.states()
        self.assertEqual(sorted(state.model for state in states), ["ess42-r", "ssd2608pr", "ykd2405pr", "yss-c"])
        self.assertEqual(sorted({bus.kind for bus in machine.client.buses()}),
                         [bus_pb.BUS_KIND_MODBUS_RTU, bus_pb.BUS_KIND_CANOPEN])
        self.shift(machine, [state.axis for state in states])

    def shift(self, machine, names):
        """The program: of the axes it knows their names."""
        client = machine.client
        for name in names:
            client.to_done("Enable", name)
            client.to_done("SetPosition", name, position=0.0)
        moves = {name: client.motion("MoveRelative", name, distance=10.0) for name in names}  # together
        for name, move in moves.items():
            self.assert_command(client.wait_ended(move), "DONE")
            state = client.state(name)
            self.assert_state(state, "STANDSTILL")
            self.assertAlmostEqual(state.position, 10.0, delta=0.02)
        for name in names:
            client.motion("MoveVelocity", name, velocity=5.0)
        for name in names:
            client.wait_state(name, lambda s: s.moving, f"{name} moves")
        result = machine.axisctl("stop", "--all")
        self.assertEqual(result.returncode, 0, result.stderr)
        for name in names:
            # The motor rests before the axis has confirmed it.
            state = client.wait_state(name, lambda s: s.state == pb.STATE_STANDSTILL, f"{name} is stopped")
            self.assertFalse(state.moving, state)
        self.assertEqual(machine.axisctl("release-stop", "--all").returncode, 0)
        for name in names:
            client.to_done("Disable", name)


if __name__ == "__main__":
    unittest.main()
