"""The example that runs without hardware: what the quick start permits can be done again."""
import concurrent.futures
import unittest

from harness.case import Scenario
from harness.demo import Demo

REFLECTION = "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo"
LIST_SERVICES = b"\x3a\x01*"


class DemoScenarios(Scenario):
    def test_tools_can_read_the_contract_from_it(self):
        demo = Demo()
        self.addCleanup(demo.close)
        reflect = demo.client.channel.stream_stream(REFLECTION)
        (listing,) = list(reflect(iter([LIST_SERVICES]), timeout=60))
        for service in (b"AxisService", b"CommandService", b"BusService", b"SystemService"):
            self.assertIn(b"axisd.v1." + service, listing)

    def test_every_axis_can_be_enabled_at_once(self):
        demo = Demo()
        self.addCleanup(demo.close)
        for state in demo.client.states():
            demo.client.wait_online(state.axis)
            demo.client.to_done("Enable", state.axis)
            self.assertEqual(demo.client.state(state.axis).drift, "")

    def test_rotary_axes_home_again_wherever_they_have_turned(self):
        demo = Demo()
        self.addCleanup(demo.close)

        def home_and_turn(axis):
            demo.client.wait_online(axis)
            demo.client.to_done("Enable", axis)
            demo.client.to_done("Home", axis)
            for turned in (330.0, -390.0):
                demo.client.to_done("MoveRelative", axis, distance=turned, velocity=180.0)
                demo.client.to_done("Home", axis)
                # A measured position of 0 wavers about 0, which is 360 as well.
                self.assertAlmostEqual((demo.client.state(axis).position + 180) % 360, 180, delta=1)
        with concurrent.futures.ThreadPoolExecutor() as threads:  # side by side: most of it is waiting
            list(threads.map(home_and_turn, ("carousel", "turntable", "dial")))


if __name__ == "__main__":
    unittest.main()
