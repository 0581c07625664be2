"""Start, enable, home, move, watch: over gRPC, and the same with axisctl."""
import json
import threading
import unittest

from harness import DONE, ENABLE, START, Scenario, axis_pb, feeder, pb, spinner


class Watcher(threading.Thread):
    """Reads WatchAxes until told to end."""

    def __init__(self, client, axes=()):
        super().__init__(daemon=True)
        request = axis_pb.WatchAxesRequest(axes=axes)
        request.period.FromMilliseconds(20)
        self.batches, self.stream = [], client.axis.WatchAxes(request)
        self.start()

    def run(self):
        try:
            for batch in self.stream:
                self.batches.append(batch)
        except Exception as error:  # the cancellation, or what the test will find missing
            self.error = error

    def end(self):
        self.stream.cancel()
        self.join()
        return self.batches


class StartToDone(Scenario):
    def test_found_energised(self):
        """M1: the drive's own bit is shown; it is neither switched off nor taken for enabled by us."""
        machine = self.machine({"spinner": spinner(simulated="switch.enabled_at_power_up=on")}).start()
        state = machine.client.state("spinner")
        self.assert_state(state, "STANDSTILL")
        self.assertEqual((state.enabled, state.enabled_by_daemon), (True, False))
        self.assertEqual(machine.wire.writes(ENABLE) + machine.wire.writes(START), [])
        machine.client.to_done("Enable", "spinner")
        self.assertTrue(machine.client.state("spinner").enabled_by_daemon)

    def test_grpc(self):
        machine = self.machine({"feeder": feeder(), "spinner": spinner(node=2)}).start()
        client = machine.client
        found = client.state("feeder")
        self.assert_state(found, "DISABLED")
        self.assertEqual((found.enabled, found.trust, found.simulated, found.model, found.node),
                         (False, pb.POSITION_TRUST_UNKNOWN, False, "ykd2405pr", 1))
        self.assertEqual(machine.sim.shaft(1).starts, 0)

        client.to_done("Enable", "feeder")
        self.assert_state(client.state("feeder"), "STANDSTILL")
        self.assertEqual(client.motion("Home", "feeder", wait=DONE).state, pb.COMMAND_STATE_DONE)
        homed = client.state("feeder")
        self.assertEqual((homed.trust, homed.position, homed.homed), (pb.POSITION_TRUST_HOMED, 0.0, True))
        # The edge lies at -20000 pulses; the drive finds it at its search speed.
        self.assertAlmostEqual(machine.sim.shaft(1).position, -20000, delta=20)

        watcher = Watcher(machine.connect())
        before = machine.sim.shaft(1)
        command = client.to_done("MoveAbsolute", "feeder", position=120.0)
        self.assertEqual(machine.sim.shaft(1), (before.position + 240000, False, before.starts + 1))
        end = client.state("feeder")
        batches = watcher.end()
        self.assertEqual((command.asked.position, command.granted.position, command.granted.velocity),
                         (120.0, 120.0, 100.0))
        self.assertTrue(command.started_at.ToNanoseconds() >= command.accepted_at.ToNanoseconds())
        self.assertTrue(command.ended_at.ToNanoseconds() > command.started_at.ToNanoseconds())
        self.assertEqual((end.position, end.moving, end.trust), (120.0, False, pb.POSITION_TRUST_HOMED))
        self.assert_state(end, "STANDSTILL")

        # One batch per tick, all axes in it, positions in order.
        self.assertEqual([batch.tick for batch in batches], list(range(1, len(batches) + 1)))
        self.assertEqual({tuple(state.axis for state in batch.axes) for batch in batches}, {("feeder", "spinner")})
        self.assertEqual(len({batch.instance_id for batch in batches}), 1)
        positions = [batch.axes[0].position for batch in batches]
        self.assertEqual(positions, sorted(positions))
        self.assertGreater(len({p for p in positions if 0.0 < p < 120.0}), 5)
        moving = [batch.axes[0] for batch in batches if batch.axes[0].moving]
        self.assertEqual({state.state for state in moving}, {pb.STATE_DISCRETE_MOTION})
        self.assertEqual({state.target for state in moving}, {120.0})
        # The other one did nothing.
        self.assertEqual(machine.wire.writes(START, node=2), [])
        self.assertEqual(machine.daemon.terminate(), 0)

    def axisctl(self, machine, *words, status=0):
        done = machine.axisctl(*words)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return done

    def test_axisctl(self):
        machine = self.machine({"feeder": feeder()}).start()
        self.axisctl(machine, "enable", "feeder", "--wait")
        self.axisctl(machine, "home", "feeder", "--wait")
        (line,) = self.axisctl(machine, "--json", "move", "feeder", "120mm", "--velocity", "50mm/s",
                               "--wait").stdout.splitlines()[-1:]
        command = json.loads(line)
        self.assertIn("COMMAND_STATE_DONE", json.dumps(command))
        self.assertEqual(machine.client.state("feeder").position, 120.0)
        state = json.loads(self.axisctl(machine, "--json", "state", "feeder").stdout)
        self.assertIn('"position": 120', json.dumps(state))
        self.assertIn("feeder", self.axisctl(machine, "list").stdout)
        self.axisctl(machine, "move", "feeder", "-10", "--relative", "--wait")
        self.assertEqual(machine.client.state("feeder").position, 110.0)

        starts = machine.sim.shaft().starts
        refused = self.axisctl(machine, "move", "feeder", "500mm", "--wait", status=4)
        self.assertRegex(refused.stderr, r"\Aaxisctl: .*400[^\n]*\n\Z")
        unknown = self.axisctl(machine, "move", "nowhere", "5", status=4)
        self.assertIn("nowhere", unknown.stderr)
        self.assertEqual(machine.sim.shaft().starts, starts)
        self.axisctl(machine, "disable", "feeder", "--wait")
        self.assert_state(machine.client.state("feeder"), "DISABLED")


if __name__ == "__main__":
    unittest.main()
