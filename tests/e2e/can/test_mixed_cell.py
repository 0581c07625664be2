"""Three RS-485 models and a YSS-C in one machine, driven by one program that does not know which is which."""
import unittest

from harness import CanScenario, feeder, pb, spinner, turntable


class MixedCell(CanScenario):
    def test_one_program_for_all(self):
        axes = {"feeder": feeder(1), "lifter": feeder(2, model="ssd2608pr"), "mixer": spinner(3, model="ess42-r"),
                "table": turntable(5)}
        machine = self.idle_cell(axes).start()
        client = machine.client
        names = [state.axis for state in client.states()]
        self.assertEqual(sorted(names), sorted(axes))
        moves = {}
        for name in names:
            client.to_done("Enable", name)
            client.to_done("SetPosition", name, position=0.0)
        for name in names:  # together
            moves[name] = client.motion("MoveRelative", name, distance=10.0)
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
            state = client.wait_state(name, lambda s: not s.moving, f"{name} rests")
            self.assertEqual(state.state, pb.STATE_STANDSTILL, state)
        self.assertEqual(machine.axisctl("release-stop", "--all").returncode, 0)
        for name in names:
            client.to_done("Disable", name)


if __name__ == "__main__":
    unittest.main()
