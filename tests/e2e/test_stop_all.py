"""StopAll: every axis stops, and nothing moves until it is released, restarts included."""
import time
import unittest

from harness import DONE, START, STOP, Scenario, feeder, pb, spinner, system_pb


class StopAll(Scenario):
    def test_all_stop_and_stay(self):
        axes = {"feeder": feeder(1), "spinner": spinner(2), "idle": spinner(3), "far": spinner(1, bus="second")}
        machine = self.machine(axes).start()
        client = machine.client
        for axis in axes:
            client.to_done("Enable", axis)
        client.to_done("SetPosition", "feeder", position=0.0)
        for axis in ("spinner", "far"):
            client.motion("MoveVelocity", axis, velocity=5.0)
        move = self.move_under_way(machine)
        called = time.monotonic_ns()
        response = client.call(client.system.StopAll, system_pb.StopAllRequest(wait_until=DONE), timeout=60)
        self.assertEqual([result.axis for result in response.results], list(axes))
        for result in response.results:
            self.assert_command(result.command, "DONE")
            self.assertFalse(result.HasField("error"))
        self.assert_command(client.get_command(move), "ABORTED")
        # Each of them got its stop, those that rested, too (M13).
        for bus, node in (("line", 1), ("line", 2), ("line", 3), ("second", 1)):
            self.assertFalse(machine.lines[bus].shaft(node).moving)
            self.assertTrue(machine.wire.writes(STOP, 0, node=node, bus=bus, since=called), (bus, node))
        self.inhibited(machine)

        self.assertEqual(machine.daemon.terminate(), 0)
        machine.start_daemon()
        for axis in axes:
            client.wait_online(axis)
        self.inhibited(machine)

        client.call(client.system.ReleaseStopAll, system_pb.ReleaseStopAllRequest())
        self.assertFalse(client.info().inhibited)
        self.assertFalse(client.state("feeder").inhibited)
        self.assertEqual(machine.wire.writes(START, since=called), [])
        client.to_done("MoveAbsolute", "feeder", position=1.0)
        # The release survives a restart as well.
        self.assertEqual(machine.daemon.terminate(), 0)
        machine.start_daemon()
        self.assertFalse(client.info().inhibited)

    def inhibited(self, machine):
        client = machine.client
        info = client.info()
        self.assertTrue(info.inhibited)
        self.assertTrue(info.inhibited_by)
        self.assertTrue(client.state("feeder").inhibited)
        starts = [machine.lines["line"].shaft(node).starts for node in (1, 2, 3)]
        for method, axis, fields in (("MoveAbsolute", "feeder", {"position": 1.0}), ("Home", "feeder", {}),
                                     ("MoveRelative", "idle", {"distance": 1.0}), ("Jog", "idle", {"velocity": 1.0}),
                                     ("MoveVelocity", "far", {"velocity": 1.0})):
            detail = self.refused("FAILED_PRECONDITION", "INHIBITED", client.motion, method, axis, **fields)
            self.assertTrue(detail.remedy)
        self.assertEqual(starts, [machine.lines["line"].shaft(node).starts for node in (1, 2, 3)])

    def test_survives_a_kill(self):
        machine = self.ready_spinner()
        machine.client.motion("MoveVelocity", "spinner", velocity=5.0, wait=pb.WAIT_UNTIL_STARTED)
        machine.client.call(machine.client.system.StopAll, system_pb.StopAllRequest(wait_until=DONE))
        machine.daemon.kill()
        machine.start_daemon()
        machine.client.wait_online("spinner")
        self.assertTrue(machine.client.info().inhibited)
        done = machine.axisctl("release-stop", "--all")
        self.assertEqual(done.returncode, 0, done.stderr)
        machine.client.to_done("Enable", "spinner")
        machine.client.to_done("MoveRelative", "spinner", distance=1.0)

    def test_axisctl(self):
        machine = self.ready_spinner()
        machine.client.motion("MoveVelocity", "spinner", velocity=5.0, wait=pb.WAIT_UNTIL_STARTED)
        done = machine.axisctl("stop", "--all", "--wait")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertFalse(machine.sim.shaft().moving)
        self.assertTrue(machine.client.info().inhibited)


if __name__ == "__main__":
    unittest.main()
