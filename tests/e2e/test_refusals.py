"""What is refused before the wire, with the reason and the permitted range."""
import math
import time
import unittest

import grpc

from harness import CallFailed, Scenario, axis_pb, error_pb, feeder, pb, spinner


class WrongModel(Scenario):
    def test_both_are_named(self):
        machine = self.machine({"feeder": feeder()})
        machine.start_lines()
        machine.sim.poke(0x0000, 0x0305)
        machine.start_daemon()
        state = machine.client.wait_state("feeder", lambda s: s.link_error.reason == error_pb.REASON_WRONG_MODEL,
                                          "the wrong model is found")
        self.assertEqual(state.link, pb.LINK_STATE_CONFIGURING)
        self.assertIn("0x0305", state.link_error.message)
        self.assertIn("ykd2405pr", state.link_error.message)
        self.assertEqual((state.link_error.bus, state.link_error.node), ("line", 1))
        detail = self.refused("FAILED_PRECONDITION", "WRONG_MODEL", machine.client.motion, "Enable", "feeder")
        self.assertIn("0x0305", detail.message)
        self.assertEqual(machine.wire.writes(), [])
        # The right drive in its place is taken over by itself.
        machine.sim.poke(0x0000, 0x0301)
        machine.client.wait_online("feeder")


class Requests(Scenario):
    def test_nothing_is_sent(self):
        machine = self.machine({"feeder": feeder(), "spinner": spinner(node=2)}).start()
        client = machine.client
        client.to_done("Enable", "feeder")
        client.to_done("SetPosition", "feeder", position=0.0)
        client.to_done("Enable", "spinner")
        since = time.monotonic_ns()
        for check in (self.malformed, self.out_of_range, self.preconditions):
            with self.subTest(check=check.__name__):
                check(client)
        self.assertEqual([str(frame) for frame in machine.wire.writes(since=since)], [])
        self.assertEqual((machine.sim.shaft(1).starts, machine.sim.shaft(2).starts), (0, 0))
        # And the axis is as usable as before.
        client.to_done("MoveAbsolute", "feeder", position=1.0)

    def malformed(self, client):
        invalid = ("INVALID_ARGUMENT", "INVALID_ARGUMENT", client.motion)
        for value in (math.nan, math.inf, -math.inf):
            for method, field in (("MoveAbsolute", "position"), ("MoveRelative", "distance"),
                                  ("MoveVelocity", "velocity"), ("Jog", "velocity"), ("SetPosition", "position")):
                self.refused(*invalid, method, "feeder", **{field: value})
            self.refused(*invalid, "MoveAbsolute", "feeder", position=1.0, velocity=value)
        for method in ("MoveAbsolute", "MoveRelative", "MoveVelocity", "Jog", "SetPosition"):
            self.refused(*invalid, method, "feeder")  # the value itself is missing
        for method in ("Enable", "Home", "Reset"):
            self.refused(*invalid, method, "feeder", request_id="")
        self.refused(*invalid, "Enable", "feeder", request_id="x" * 129)
        self.refused(*invalid, "Enable", "feeder", request_id="two words")
        self.refused(*invalid, "Enable", "feeder", options={"buffer_mode": 9})
        self.refused(*invalid, "Enable", "feeder", wait=9)
        # Without any options there is no request_id either.
        with self.assertRaises(CallFailed) as missing:
            client.call(client.axis.Enable, axis_pb.EnableRequest(axis="feeder"))
        self.assertEqual(missing.exception.code, grpc.StatusCode.INVALID_ARGUMENT)
        for axis in ("nowhere", "", "FEEDER", "press/feeder"):
            with self.assertRaises(CallFailed) as unknown:
                client.motion("Stop", axis)
            self.assertIn(unknown.exception.code, (grpc.StatusCode.NOT_FOUND, grpc.StatusCode.INVALID_ARGUMENT))
        self.refused("NOT_FOUND", "UNKNOWN_AXIS", client.motion, "Enable", "nowhere")
        self.refused("NOT_FOUND", "UNKNOWN_AXIS", client.state, "nowhere")

    def range_of(self, client, reason, method, axis, **fields):
        permitted = self.refused("OUT_OF_RANGE", reason, client.motion, method, axis, **fields).permitted
        return permitted.minimum, permitted.maximum, permitted.unit

    def out_of_range(self, client):
        for position in (400.1, -0.1, 1e300):
            self.assertEqual(self.range_of(client, "SOFT_LIMIT", "MoveAbsolute", "feeder", position=position),
                             (0.0, 400.0, "mm"))
        self.assertEqual(self.range_of(client, "SOFT_LIMIT", "MoveRelative", "feeder", distance=400.5)[2], "mm")
        # 10000 pulses/rev at 200 kHz: 1200 r/min, 100 mm/s. The lowest is one r/min.
        for velocity in (100.2, 150.0, 1e9):
            low, high, unit = self.range_of(client, "OUT_OF_RANGE", "MoveAbsolute", "feeder", position=5.0,
                                            velocity=velocity)
            self.assertEqual((high, unit), (100.0, "mm/s"))
            self.assertGreater(low, 0.0)
        for velocity in (0.0, -5.0, 1e-6):
            low, high, unit = self.range_of(client, "OUT_OF_RANGE", "MoveAbsolute", "feeder", position=5.0,
                                            velocity=velocity)
            self.assertEqual((high, unit), (100.0, "mm/s"))
        self.assertEqual(self.range_of(client, "OUT_OF_RANGE", "MoveVelocity", "spinner", velocity=11.0)[2], "rev/s")
        for field in ("acceleration_time", "deceleration_time"):
            for value in (-1.0, 2.001, 30.0):
                low, high, unit = self.range_of(client, "OUT_OF_RANGE", "MoveAbsolute", "feeder", position=5.0,
                                                **{field: value})
                self.assertTrue(0 <= low < high, (low, high, unit))
                self.assertTrue(unit)
        for value in (0.0, 2.5):
            self.range_of(client, "OUT_OF_RANGE", "Jog", "feeder", velocity=5.0, hold=value)

    def preconditions(self, client):
        self.refused("UNIMPLEMENTED", "NOT_SUPPORTED", client.motion, "Jog", "feeder", velocity=5.0,
                     options={"buffer_mode": pb.BUFFER_MODE_BUFFERED})
        self.refused("UNIMPLEMENTED", "NOT_SUPPORTED", client.motion, "Home", "spinner")
        self.refused("FAILED_PRECONDITION", "NOT_TRUSTED", client.motion, "MoveAbsolute", "spinner", position=5.0)
        self.refused("DEADLINE_EXCEEDED", "EXPIRED", client.motion, "MoveAbsolute", "feeder", position=5.0,
                     options={"not_after": {"seconds": int(time.time()) - 1}})
        self.refused("OUT_OF_RANGE", "OUT_OF_RANGE", client.motion, "MoveAbsolute", "feeder", position=5.0,
                     options={"not_after": {"seconds": int(time.time()) + 3600}})
        self.refused("ABORTED", "LEASE_LOST", client.motion, "MoveAbsolute", "feeder", position=5.0,
                     options={"lease_token": 7})


class Disabled(Scenario):
    def test_needs_enable(self):
        machine = self.machine({"feeder": feeder()}).start()
        client = machine.client
        for method, fields in (("Home", {}), ("MoveAbsolute", {"position": 1.0}), ("MoveRelative", {"distance": 1.0}),
                               ("Jog", {"velocity": 1.0}), ("MoveVelocity", {"velocity": 1.0})):
            self.refused("FAILED_PRECONDITION", "DISABLED", client.motion, method, "feeder", **fields)
        self.assertEqual(machine.wire.writes(0x0029), [])


if __name__ == "__main__":
    unittest.main()
