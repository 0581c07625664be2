"""A gateway of several machines: each call and each lane is for one of them, and for no other."""
import re
import unittest

from harness import axis_pb, spinner, system_pb, wait_for
from support import ANSWER, LaneRefused, Page, Web, WebScenario, move_request


class Machines(WebScenario):
    def setUp(self):
        super().setUp()
        self.start_machine()
        self.other = self.machine({"spinner": spinner()})
        self.other.start()
        self.other.client.to_done("Enable", "spinner")
        self.gateway = Web(self.subject, axisd=f"machines: {{ press-1: \"unix:{self.subject.socket}\", "
                                               f"press-2: {{ server: \"unix:{self.other.socket}\" }} }}")
        self.addCleanup(self.gateway.stop)
        self.gateway.start()
        self.page = Page(self.gateway)

    def test_each_call_is_for_one_machine(self):
        self.assertEqual(self.page.session()[1]["machines"], [{"name": "press-1", "trouble": ""}, {"name": "press-2", "trouble": ""}])
        ids = {self.page.call("SystemService/GetInfo", system_pb.GetInfoRequest(), system_pb.GetInfoResponse,
                              axisd_machine=name).instance_id for name in ("press-1", "press-2")}
        self.assertEqual(len(ids), 2)
        for headers in ({}, {"axisd_machine": "press-3"}):
            self.assertEqual(self.page.post("SystemService/GetInfo", system_pb.GetInfoRequest(), **headers)[0], 404)

    def test_each_lane_is_for_one_machine(self):
        for name in (None, "press-3"):
            with self.assertRaises(LaneRefused) as refused:
                self.page.lane(machine=name)
            self.assertEqual(refused.exception.args, (404,))
        lane = self.lane(self.page, machine="press-2")
        wait_for(lambda: lane.ask("AxisService/MoveVelocity", move_request())[:2] == (ANSWER, 0), "a start in time")
        self.other.sim.wait_moving()
        self.assertEqual(self.subject.sim.shaft().starts, 0)
        self.assertEqual(lane.ask("AxisService/Stop", axis_pb.StopRequest(axis="spinner"))[:2], (ANSWER, 0))
        self.other.sim.wait_rest()

    def test_one_that_is_away_leaves_the_others(self):
        self.other.daemon.kill()
        wait_for(lambda: self.gateway.request("GET", "/healthz")[0] == 503, "the gateway tells that one is away")
        self.assertRegex(self.gateway.request("GET", "/healthz")[2].decode(), "^press-2: axisd does not answer at unix:")
        first, second = self.page.session()[1]["machines"]
        self.assertEqual(first["trouble"], "")
        self.assertTrue(re.match("axisd does not answer", second["trouble"]), second)
        lane = self.lane(self.page, machine="press-1")
        wait_for(lambda: lane.ask("AxisService/MoveVelocity", move_request())[:2] == (ANSWER, 0), "a start in time")
        self.subject.sim.wait_moving()
        self.assertEqual(lane.ask("AxisService/Stop", axis_pb.StopRequest(axis="spinner"))[:2], (ANSWER, 0))
        self.stands_for_good()


if __name__ == "__main__":
    unittest.main()
