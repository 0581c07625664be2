"""Calls through an entrance: any method, streams, errors, and what is refused."""
import threading
import time
import unittest
import urllib.request

import grpc

from harness import axis_pb, command_pb, pb, system_pb, wait_for
from support import HOST, CellScenario, Entrance, cell_pb, event_pb


class Forwarding(CellScenario):
    def two(self, **arguments):
        """press-1 with an entrance, press-2 without: by hand."""
        self.one, self.other = self.press(1), self.press(2)
        self.here = self.entrance(self.one, keys=f"peers: {{ press-2: {{ axisd: \"unix:{self.other.socket}\" }} }}",
                                  **arguments)
        wait_for(lambda: [m.state for m in self.here.machines().values()] == [cell_pb.MACHINE_STATE_PRESENT] * 2,
                 "both are there")
        return self.here

    def info(self, name, **arguments):
        return self.here.at(name, self.here.client.system.GetInfo, system_pb.GetInfoRequest(), **arguments)

    def test_a_call_goes_to_the_machine_that_it_names(self):
        self.two()
        self.assertEqual(self.info(None).machine, "press-1")
        self.assertEqual(self.info("press-1").machine, "press-1")
        self.assertEqual(self.info("press-2").machine, "press-2")
        self.assertEqual(self.info("press-2").instance_id, self.other.client.info().instance_id)

    def test_motion_happens_there_and_once(self):
        self.two()
        stub = self.here.client.axis
        options = {"request_id": "one-move", "wait_until": pb.WAIT_UNTIL_DONE}
        self.here.at("press-2", stub.Enable, axis_pb.EnableRequest(axis="spinner", options=options | {"request_id": "e"}))
        request = axis_pb.MoveRelativeRequest(axis="spinner", distance=2.0, velocity=5.0, options=options)
        first = self.here.at("press-2", stub.MoveRelative, request).command
        again = self.here.at("press-2", stub.MoveRelative, request).command
        self.assertEqual((first.id, first.state), (again.id, pb.COMMAND_STATE_DONE))
        self.assertEqual(self.other.sim.shaft().starts, 1)
        self.assertEqual(self.one.sim.shaft().starts, 0)

    def test_errors_arrive_as_they_are(self):
        self.two()
        direct = self.refused("NOT_FOUND", "UNKNOWN_AXIS", self.other.client.state, "nobody")
        passed = self.refused("NOT_FOUND", "UNKNOWN_AXIS", self.here.at, "press-2", self.here.client.axis.GetAxis,
                              axis_pb.GetAxisRequest(axis="nobody"))
        self.assertEqual(direct, passed)

    def test_streams_go_on_until_the_caller_leaves(self):
        self.two()
        stream = self.here.client.axis.WatchAxes(axis_pb.WatchAxesRequest(period={"nanos": 50_000_000}),
                                                 metadata=(("axisd-machine", "press-2"),))
        for _ in range(5):
            self.assertEqual(next(stream).axes[0].axis, "spinner")
        stream.cancel()
        wait_for(lambda: self.metric('axisd_cell_forwarded_open{machine="press-2"}') == 0, "the stream has ended")

    def metric(self, name):
        """A sample of the entrance's metrics; None: there is none."""
        text = urllib.request.urlopen(f"http://{self.metrics}/metrics", timeout=10).read().decode()
        for line in text.splitlines():
            if line.startswith(name + " "):
                return float(line.rsplit(" ", 1)[1])
        return None

    def setUp(self):
        super().setUp()
        self.metrics = f"{HOST}:{9465}"

    def entrance(self, machine, *arguments, keys="", **named):
        return super().entrance(machine, *arguments, keys=f"metrics: {{ listen: \"{self.metrics}\" }}\n{keys}", **named)

    def test_a_deadline_is_carried(self):
        self.two()
        stub = self.here.client.event
        stream = stub.WatchEvents(event_pb.WatchEventsRequest(), timeout=0.7, metadata=(("axisd-machine", "press-2"),))
        begin = time.monotonic()
        with self.assertRaises(grpc.RpcError) as caught:
            for _ in stream:
                pass
        self.assertIs(caught.exception.code(), grpc.StatusCode.DEADLINE_EXCEEDED)
        self.assertLess(time.monotonic() - begin, 10)
        wait_for(lambda: self.metric('axisd_cell_forwarded_open{machine="press-2"}') == 0, "it has ended there, too")

    def test_a_killed_machine_ends_its_calls_and_refuses_others(self):
        self.two()
        stream = self.here.client.axis.WatchAxes(axis_pb.WatchAxesRequest(), metadata=(("axisd-machine", "press-2"),))
        next(stream)
        self.other.daemon.kill()
        with self.assertRaises(grpc.RpcError) as caught:
            for _ in stream:
                pass
        self.assertIs(caught.exception.code(), grpc.StatusCode.UNAVAILABLE)
        self.here.wait_for_state("press-2", cell_pb.MACHINE_STATE_SILENT)
        detail = self.refused("UNAVAILABLE", "OFFLINE", self.info, "press-2")
        self.assertIn("press-2", detail.message)
        self.assertEqual(self.info("press-1").machine, "press-1")
        self.other.start_daemon()
        self.here.wait_for_state("press-2", cell_pb.MACHINE_STATE_PRESENT)
        self.assertEqual(self.info("press-2").machine, "press-2")

    def test_a_call_that_moves_is_not_repeated_for_a_machine_that_died(self):
        self.two()
        self.other.daemon.kill()
        request = axis_pb.EnableRequest(axis="spinner", options={"request_id": "late"})
        with self.assertRaises(Exception):
            self.here.at("press-2", self.here.client.axis.Enable, request, timeout=3)
        self.other.start_daemon()
        self.here.wait_for_state("press-2", cell_pb.MACHINE_STATE_PRESENT)
        self.other.client.wait_online("spinner")
        own = self.other.client
        self.assertEqual(len(own.call(own.command.ListCommands, command_pb.ListCommandsRequest(axis="spinner")).commands), 0)

    def test_names_from_strangers(self):
        self.two()
        for name in ("press-9", "PRESS-1", "a b", "x" * 3000, "../../etc", "-"):
            detail = self.refused("NOT_FOUND", "INVALID_ARGUMENT", self.info, name)
            self.assertLess(len(detail.message), 200)
        self.assertEqual(self.info("press-2").machine, "press-2")

    def test_forged_hops_users_and_roles(self):
        self.two()
        self.refused("FAILED_PRECONDITION", "INVALID_ARGUMENT", self.info, "press-2", more=(("axisd-hops", "1"),))
        for forged in ((("axisd-user", "anna"),), (("axisd-role", "maintainer"),),
                       (("axisd-user", "anna"), ("axisd-role", "maintainer"))):
            self.refused("PERMISSION_DENIED", "ACCESS_DENIED", self.info, "press-2", more=forged)
        # A stop is executed whoever it claims to be of, as the entrance's own.
        stop = axis_pb.StopRequest(axis="spinner")
        command = self.here.at("press-2", self.here.client.axis.Stop, stop, more=(("axisd-user", "anna"),)).command
        self.assertNotIn("anna", command.client)

    def test_an_address_that_leads_to_an_entrance_is_a_loop(self):
        self.two()
        third = self.press(3, start=False)
        loop = Entrance(third, keys=f"peers: {{ press-2: {{ axisd: \"{self.here.address}\" }} }}")
        self.addCleanup(loop.close)
        loop.start()
        loop.wait_for_state("press-2", cell_pb.MACHINE_STATE_SILENT)
        self.assertIn("a loop", loop.machines()["press-2"].trouble)
        detail = self.refused("UNAVAILABLE", "OFFLINE", loop.at, "press-2", loop.client.system.GetInfo,
                              system_pb.GetInfoRequest())
        self.assertIn("a loop", detail.message)

    def test_a_wrong_address_is_told(self):
        one, other = self.press(1), self.press(2)
        here = self.entrance(one, keys=f"peers: {{ press-3: {{ axisd: \"unix:{other.socket}\" }} }}")
        here.wait_for_state("press-3", cell_pb.MACHINE_STATE_SILENT)
        self.assertIn("leads to the machine 'press-2'", here.machines()["press-3"].trouble)
        self.refused("UNAVAILABLE", "OFFLINE", here.at, "press-3", here.client.system.GetInfo,
                     system_pb.GetInfoRequest())

    def test_one_caller_has_so_many_calls_and_stops_beyond(self):
        self.here = None
        self.one = self.press(1)
        self.here = self.entrance(self.one, keys="limits: { calls_each: 16 }")
        self.here.wait_for_state("press-1", cell_pb.MACHINE_STATE_PRESENT)
        streams = []
        for _ in range(16):
            streams.append(self.here.client.axis.WatchAxes(axis_pb.WatchAxesRequest()))
            next(streams[-1])
        self.refused("RESOURCE_EXHAUSTED", "BUSY", self.here.at, None, self.here.client.axis.GetAxis,
                     axis_pb.GetAxisRequest(axis="spinner"))
        self.here.at(None, self.here.client.axis.Stop, axis_pb.StopRequest(axis="spinner"))
        self.assertEqual([m.outcome for m in self.here.stop_all().machines], [cell_pb.MACHINE_OUTCOME_DONE])
        streams.pop().cancel()

        def served():
            try:
                return self.here.at(None, self.here.client.axis.GetAxis, axis_pb.GetAxisRequest(axis="spinner"))
            except Exception:
                return None
        wait_for(served, "a place is free again")
        for stream in streams:
            stream.cancel()

    def test_many_callers_at_once(self):
        self.two()
        failures = []

        def ask(name):
            client = self.here.connect()
            for _ in range(100):
                answer = self.here.at(name, client.system.GetInfo, system_pb.GetInfoRequest())
                if answer.machine != name:
                    failures.append(answer.machine)
        threads = [threading.Thread(target=ask, args=(f"press-{1 + i % 2}",)) for i in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(failures, [])

    def test_calls_that_are_cut_off_in_the_middle(self):
        """For the sanitizers: cancelled before, while and after a message is passed on."""
        self.two()
        for index in range(200):
            stream = self.here.client.axis.WatchAxes(axis_pb.WatchAxesRequest(period={"nanos": 20_000_000}),
                                                     metadata=(("axisd-machine", "press-2"),))
            if index % 3 == 1:
                next(stream)
            if index % 3 == 2:
                time.sleep(0.002)
            stream.cancel()
        wait_for(lambda: self.metric('axisd_cell_forwarded_open{machine="press-2"}') == 0, "all have ended")
        self.assertEqual(self.info("press-2").machine, "press-2")

    def test_ends_in_order_while_streams_are_open(self):
        self.two()
        stream = self.here.client.axis.WatchAxes(axis_pb.WatchAxesRequest(), metadata=(("axisd-machine", "press-2"),))
        next(stream)
        events = self.here.client.cell.WatchEvents(cell_pb.WatchEventsRequest(after_sequence=0))
        next(events)
        self.assertEqual(self.here.program.terminate(), 0)
        for each in (stream, events):
            with self.assertRaises(grpc.RpcError):
                for _ in each:
                    pass


if __name__ == "__main__":
    unittest.main()
