"""StopAll on a line of drives some of which do not answer (M15): what the wire saw, in order. How long it takes is
measured by tests/bench/stop_all_bench.py."""
import time
import unittest

from harness import STOP, Scenario, pb, spinner, system_pb, wait_for

COUNT = 6


class SilentDrives(Scenario):
    def stop_all(self, machine):
        """Calls StopAll; the requests of the line from its arrival to the first stop frame of the last drive."""
        client = machine.client
        ahead = time.time_ns() - time.monotonic_ns()
        response = client.call(client.system.StopAll, system_pb.StopAllRequest())
        self.assertEqual([result.axis for result in response.results if result.HasField("error")], [])
        arrived = min(result.command.accepted_at.ToNanoseconds() for result in response.results) - ahead

        def told():
            return {frame.node for frame in machine.wire.writes(STOP, since=arrived)}
        wait_for(lambda: len(told()) == COUNT, "each drive has its stop")
        client.call(client.system.ReleaseStopAll, system_pb.ReleaseStopAllRequest())
        seen, nodes = [], set()
        for frame in machine.wire.requests(since=arrived):
            seen.append(frame)
            nodes |= {frame.node} if frame.writes(STOP) else set()
            if len(nodes) == COUNT:
                return seen
        raise AssertionError("unreachable: each drive has its stop")

    def check(self, seen, known_silent=()):
        """Behind what was under way (of an earlier stop, perhaps) nothing but stops, one for each drive, and those that are
        known to be silent last."""
        shown = "\n".join(str(frame) for frame in seen)
        order = [frame.node for frame in seen[1:] if frame.writes(STOP)]
        self.assertEqual(len(order), len(seen) - 1, f"only stops:\n{shown}")
        self.assertEqual(len(order), len(set(order)), f"one each:\n{shown}")
        by_turn = sorted(order, key=lambda node: node in known_silent)
        self.assertEqual(order, by_turn, f"who answers goes first:\n{shown}")

    def test_stops_of_those_that_answer_wait_for_nobody(self):
        # Few, each with a long wait, for computers that are late; together less than the 2 s after which a stop lets nobody
        # go first (TransactionQueue::doubtful_patience).
        axes = {node: f"axis{node:02}" for node in range(1, COUNT + 1)}
        machine = self.machine({name: spinner(node) for node, name in axes.items()}, turnaround="250 ms")
        machine.start_lines()
        machine.start_daemon()
        client = machine.client
        for silent in ({6}, {2, 3}, set(axes) - {4}):
            with self.subTest(silent=len(silent)):
                machine.sim.control("fault clear")
                for name in axes.values():
                    client.wait_online(name)
                for node in silent:
                    machine.sim.control(f"fault drop_request count=-1 node={node}")
                self.check(self.stop_all(machine))
                for node in silent:
                    client.wait_state(axes[node], lambda s: s.link == pb.LINK_STATE_OFFLINE, "known to be silent")
                for node in set(axes) - silent:
                    client.wait_online(axes[node])
                # Meanwhile each has a stop that is owed to it: again one frame each, and not two.
                for _ in range(3):
                    self.check(self.stop_all(machine), silent)


if __name__ == "__main__":
    unittest.main()
