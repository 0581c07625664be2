"""The lane of a page: what is jogged over it ends with it, by the simulator's truth, and never moves afterwards."""
import http.client
import os
import signal
import time
import unittest

from harness import DONE, OWN_NAME, axis_pb, command_pb, group_pb, lease_pb, pb, system_pb, wait_for
from support import ANSWER, DELEGATE, ECHO, LATE, REFUSED, LaneRefused, Page, WebScenario, frame, jog_request, move_request


class Motion(WebScenario):
    def setUp(self):
        super().setUp()
        self.start_machine()
        self.gateway = self.web().start()
        self.page = Page(self.gateway)
        self.wire = self.lane(self.page)

    def command(self, answer, kind=axis_pb.JogResponse):
        self.assertEqual(answer[:2], (ANSWER, 0), answer)
        return kind.FromString(answer[3]).command

    def test_a_button_is_pressed_and_let_go(self):
        self.assertEqual(self.wire.ask("")[0], ECHO)
        finger = self.held(self.wire)
        finger.let_go()
        answer = self.wire.ask("AxisService/Halt", axis_pb.HaltRequest(axis="spinner", options={"wait_until": DONE}))
        self.command(answer, axis_pb.HaltResponse)
        self.stands_for_good()
        self.assertEqual(self.subject.sim.shaft().starts, finger.starts, "renewals start nothing")

    def test_the_page_closes_its_lane(self):
        finger = self.held(self.wire, hold=2.0)
        self.wire.close()
        self.stands_for_good()
        self.was_halted()
        finger.let_go()

    def test_the_page_is_silent(self):
        finger = self.held(self.wire, hold=0.8)
        finger.let_go()
        self.stands_for_good()
        self.wire.jog(finger.press, 0.8)  # a renewal that comes too late
        self.wire.jog(finger.press, 0.8, late=0.3)
        self.stands_for_good()
        self.assertEqual(self.subject.sim.shaft().starts, finger.starts)

    def test_an_echo_is_no_renewal(self):
        finger = self.held(self.wire, hold=0.8)
        finger.let_go()
        wait_for(lambda: self.wire.ask("")[0] == ECHO and not self.subject.sim.shaft().moving, "it stands")
        self.stands_for_good()

    def test_the_gateway_is_killed(self):
        self.held(self.wire)
        self.gateway.kill()
        self.stands_for_good()

    def test_the_gateway_ends_in_order(self):
        self.held(self.wire, hold=2.0)
        self.assertEqual(self.gateway.program.terminate(), 0)
        self.stands_for_good()
        self.was_halted()

    def test_the_gateway_is_stopped_and_continued(self):
        finger = self.held(self.wire)
        os.kill(self.gateway.program.process.pid, signal.SIGSTOP)
        self.addCleanup(os.kill, self.gateway.program.process.pid, signal.SIGCONT)
        self.subject.sim.wait_rest()
        os.kill(self.gateway.program.process.pid, signal.SIGCONT)
        finger.let_go()  # what it said meanwhile renewed a press that is over
        self.stands_for_good()
        self.assertEqual(self.subject.sim.shaft().starts, finger.starts)

    def test_the_daemon_is_killed_and_comes_back(self):
        finger = self.held(self.wire)
        finger.let_go()
        self.wire.send("AxisService/Halt", axis_pb.HaltRequest(axis="spinner"))
        self.stands_for_good()
        self.subject.daemon.kill()
        wait_for(lambda: self.gateway.request("GET", "/healthz")[0] == 503, "the gateway tells that axisd is away")
        answer = self.wire.ask("AxisService/Jog", jog_request("in vain"))
        self.assertIn(answer[:2], ((ANSWER, 14), (LATE, 0)))
        self.subject.start_daemon()
        wait_for(lambda: self.gateway.request("GET", "/healthz")[0] == 200, "the gateway has found axisd again")
        self.subject.client.wait_online("spinner")
        self.subject.client.to_done("Enable", "spinner")
        self.held(self.wire).let_go()  # on the same lane
        self.stands_for_good()

    def test_a_press_that_was_refused_never_starts(self):
        self.subject.daemon.kill()
        wait_for(lambda: self.gateway.request("GET", "/healthz")[0] == 503, "the gateway tells that axisd is away")
        self.assertNotEqual(self.wire.ask("AxisService/Jog", jog_request("in vain"))[:2], (ANSWER, 0))
        self.subject.start_daemon()
        wait_for(lambda: self.gateway.request("GET", "/healthz")[0] == 200, "the gateway has found axisd again")
        self.subject.client.wait_online("spinner")
        self.subject.client.to_done("Enable", "spinner")
        for _ in range(5):  # the finger is still there
            answer = self.wire.ask("AxisService/Jog", jog_request("in vain"))
            self.assertIn(answer[:2], ((REFUSED, 9), (LATE, 0)))
        self.assertEqual(self.subject.sim.shaft().starts, 0)

    def test_a_lane_that_is_new_starts_nothing_before_it_is_measured(self):
        lane = self.page.lane()
        self.addCleanup(lane.close)
        self.assertEqual(lane.ask("")[0], ECHO)
        self.assertEqual(lane.ask_to_jog()[:2], (REFUSED, 9))
        self.assertEqual(lane.ask("LeaseService/RenewLease", lease_pb.RenewLeaseRequest())[:2], (REFUSED, 9))
        self.assertEqual(lane.ask("", b"guessed!")[0], ECHO)
        self.assertEqual(lane.ask_to_jog()[:2], (REFUSED, 9))
        self.assertEqual(lane.ask("AxisService/Stop", axis_pb.StopRequest(axis="spinner"))[:2], (ANSWER, 0))
        self.assertEqual(self.subject.sim.shaft().starts, 0)

    def test_what_starts_something_by_a_call_is_refused(self):
        for method, request in (("AxisService/Jog", jog_request("by a call")), ("StopService/Jog", jog_request("by a call")),
                                ("AxisService/MoveVelocity", move_request()), ("AxisService/Enable", axis_pb.EnableRequest()),
                                ("GroupService/MoveGroup", group_pb.MoveGroupRequest()),
                                ("SystemService/ReleaseStopAll", system_pb.ReleaseStopAllRequest())):
            status, message, _ = self.page.call(method, request, axis_pb.JogResponse)
            self.assertEqual((status, message), (9, f"{method.split('/')[1]} goes over the lane"))
        self.assertEqual(self.subject.sim.shaft().starts, 0)

    def moves(self):
        """A move is under way, by an answer that came in time, as on a computer that is busy not each does."""
        while (answer := self.wire.ask("AxisService/MoveVelocity", move_request()))[0] == LATE:
            pass
        self.command(answer, axis_pb.MoveVelocityResponse)
        self.subject.sim.wait_moving()

    def stands_behind(self, asked):
        """All of these are answered, and nobody stops anything any more: the gateway has."""
        while asked:
            asked.discard(self.wire.receive()[1])
        wait_for(lambda: self.subject.client.state("spinner").state == pb.STATE_STANDSTILL, "it stands")
        self.stands_for_good()

    def test_a_move_goes_on_without_its_page(self):
        self.moves()
        self.wire.close()
        time.sleep(0.5)
        self.assertTrue(self.subject.sim.shaft().moving)
        self.command(self.lane(self.page).ask("AxisService/Halt", axis_pb.HaltRequest(axis="spinner")), axis_pb.HaltResponse)
        self.stands_for_good()

    def test_a_move_that_was_held_up_moves_nothing(self):
        self.assertEqual(self.wire.ask("AxisService/MoveVelocity", move_request(), late=0.5)[0], LATE)
        undated = axis_pb.MoveVelocityRequest(axis="spinner", velocity=2.0)
        kind, status, message, _ = self.wire.ask("AxisService/MoveVelocity", undated)
        self.assertEqual((kind, status), (REFUSED, 3), message)
        kind, status, _, _ = self.wire.ask("AxisService/MoveVelocity", move_request(valid=-2.0))
        self.assertIn((kind, status), ((ANSWER, 9), (ANSWER, 4), (LATE, 0)))
        self.stands_for_good()
        self.assertEqual(self.subject.sim.shaft().starts, 0)

    def test_a_move_and_a_stop_behind_it_leave_it_standing(self):
        for kind in ("Halt", "Stop", "QuickStop"):
            asked = set()
            for _ in range(8):
                asked.add(self.wire.send("AxisService/MoveVelocity", move_request()))
                asked.add(self.wire.send(f"AxisService/{kind}", axis_pb.HaltRequest(axis="spinner")))  # each has it at this place
            self.stands_behind(asked)

    def test_a_move_whose_daemon_hangs_is_halted_when_it_goes_on(self):
        daemon = self.subject.daemon.process.pid
        self.addCleanup(os.kill, daemon, signal.SIGCONT)
        os.kill(daemon, signal.SIGSTOP)
        asked = {self.wire.send("AxisService/MoveVelocity", move_request(valid=30.0)),
                 self.wire.send("AxisService/Stop", axis_pb.StopRequest(axis="spinner"))}
        time.sleep(0.5)
        os.kill(daemon, signal.SIGCONT)
        self.stands_behind(asked)

    def test_a_stop_by_a_call_outlives_its_page(self):
        request = axis_pb.HaltRequest(axis="spinner", options={"wait_until": DONE})
        finger = self.held(self.wire, hold=2.0)
        finger.let_go()
        for _ in range(40):  # more than a person has places for
            connection = self.gateway.connect()
            connection.request("POST", "/axisd.v1.AxisService/Halt", frame(request.SerializeToString()), self.page.headers())
            connection.close()
        self.stands_for_good()
        wait_for(lambda: self.page.post("AxisService/Halt", request)[0] == 200, "a place for a stop")

    def test_a_press_that_was_held_up_moves_nothing(self):
        self.assertEqual(self.wire.ask("")[0], ECHO)
        self.assertEqual(self.wire.ask("AxisService/Jog", jog_request("late"), late=1.0)[0], LATE)
        self.assertEqual(self.wire.ask("LeaseService/RenewLease", lease_pb.RenewLeaseRequest(), late=1.0)[0], LATE)
        answer = self.wire.ask("AxisService/Stop", axis_pb.StopRequest(axis="spinner"), late=1.0)
        self.command(answer, axis_pb.StopResponse)
        self.assertEqual(self.subject.sim.shaft().starts, 0)

    def test_a_press_and_a_stop_that_come_together_leave_it_standing(self):
        for i in range(20):
            self.wire.jog(f"press-{i}", 2.0)
            self.wire.send("AxisService/Halt", axis_pb.HaltRequest(axis="spinner"))
        last = self.wire.ask("AxisService/Halt", axis_pb.HaltRequest(axis="spinner", options={"wait_until": DONE}))
        self.command(last, axis_pb.HaltResponse)
        self.stands_for_good()

    def test_stop_all_needs_nothing(self):
        self.held(self.wire)
        kind, status, _, _ = self.wire.ask("SystemService/StopAll", system_pb.StopAllRequest())
        self.assertEqual((kind, status), (ANSWER, 0))
        self.stands_for_good()

    def test_ten_thousand_messages_at_once_end_the_lane_and_the_jog(self):
        finger = self.held(self.wire, hold=2.0)
        echo, _ = self.wire.message("")
        try:
            for _ in range(10_000):
                self.wire.send_frame(echo)
        except OSError:
            pass
        self.assertLess(len(self.wire.until_end()), 1000)
        self.stands_for_good()
        self.was_halted()
        finger.let_go()
        self.assertEqual(self.lane(self.page).ask("")[0], ECHO, "another lane is fine")

    def test_what_is_no_message_ends_the_lane(self):
        for opcode, payload in ((2, b"nonsense"), (1, b"text"), (2, b"\1" + bytes(17_000)), (11, b""), (2, b"")):
            lane = self.lane(self.page)
            lane.send_frame(payload, opcode)
            self.assertEqual(lane.until_end(), [], (opcode, payload[:10]))
        self.assertEqual(self.wire.ask("")[0], ECHO)

    def test_half_a_message_ends_with_its_connection(self):
        finger = self.held(self.wire, hold=2.0)
        finger.let_go()
        self.wire.socket.sendall(b"\x82\xfe")
        self.wire.close()
        self.stands_for_good()
        self.was_halted()

    def test_only_what_belongs_there_is_taken(self):
        kind, status, message, _ = self.wire.ask("AxisService/GetAxis", axis_pb.GetAxisRequest(axis="spinner"))
        self.assertEqual((kind, status, message), (REFUSED, 12, "the lane takes no such call"))
        self.assertEqual(self.wire.ask("AxisService/Jog", b"\xff")[0], REFUSED)
        kind, status, message, _ = self.wire.ask("AxisService/Stop", axis_pb.StopRequest(axis="nobody"))
        self.assertEqual((kind, status), (ANSWER, 5))
        self.assertIn("nobody", message)

    def test_other_pages_have_no_lane(self):
        for origin, protocol, status in (("http://evil.example", "axisd-lane-1", 403),
                                         (f"https://localhost:{self.gateway.port}", "axisd-lane-1", 403),
                                         (None, "chat", 400)):
            with self.assertRaises(LaneRefused) as refused:
                self.page.lane(origin, protocol)
            self.assertEqual(refused.exception.args, (status,))


class Anybody(WebScenario):
    """Without users, until there is one."""

    def test_the_first_user_shuts_out_whoever_is_at_this_computer(self):
        self.start_machine(DELEGATE)
        gateway = self.web().start()
        page = Page(gateway)
        lane = self.lane(page)
        connection, following = page.stream("AxisService/WatchAxes", axis_pb.WatchAxesRequest(), axis_pb.WatchAxesResponse)
        self.addCleanup(connection.close)
        self.assertIsNotNone(following())
        self.held(lane, hold=2.0)
        gateway.user("add", "anna", "--role", "operator", password="correct horse")
        lane.until_end()
        self.stands_for_good()
        self.was_halted()
        with self.assertRaises((http.client.IncompleteRead, ConnectionError)):
            while following() is not None:
                pass
            raise ConnectionError  # it ended in order
        self.assertEqual(page.session()[0], 401)


class Persons(WebScenario):
    def setUp(self):
        super().setUp()
        self.start_machine(DELEGATE)
        self.gateway = self.web()
        self.gateway.user("add", "anna", "--role", "operator", password="correct horse")
        self.gateway.user("add", "bert", "--role", "viewer", password="battery staple")
        self.gateway.start()

    def logged_in(self, name, password):
        page = Page(self.gateway)
        self.assertEqual(page.log_in(name, password)[0], 204)
        return page

    def test_nobody_has_no_lane(self):
        with self.assertRaises(LaneRefused) as refused:
            Page(self.gateway).lane()
        self.assertEqual(refused.exception.args, (401,))

    def test_the_daemon_knows_who_jogs(self):
        lane = self.lane(self.logged_in("anna", "correct horse"))
        self.held(lane).let_go()
        client = self.subject.client
        request = command_pb.GetCommandRequest(id=client.state("spinner").command_id)
        self.assertTrue(client.call(client.command.GetCommand, request).command.client.startswith("anna via unix:"))
        lane.send("AxisService/Halt", axis_pb.HaltRequest(axis="spinner"))
        self.stands_for_good()

    def test_a_viewer_may_stop_and_not_jog(self):
        lane = self.lane(self.logged_in("bert", "battery staple"))
        kind, status, message, _ = lane.ask_to_jog()
        self.assertEqual((kind, status), (ANSWER, 7), message)
        self.assertEqual(lane.ask("AxisService/Stop", axis_pb.StopRequest(axis="spinner"))[:2], (ANSWER, 0))
        self.assertEqual(self.subject.sim.shaft().starts, 0)

    def test_the_end_of_a_session_ends_its_jog(self):
        page = self.logged_in("anna", "correct horse")
        lane = self.lane(page)
        self.held(lane, hold=2.0)
        self.assertEqual(page.log_out(), 204)
        lane.until_end()
        self.stands_for_good()
        self.was_halted(f"anna via {OWN_NAME}")

    def test_a_user_who_is_removed_is_out(self):
        page = self.logged_in("anna", "correct horse")
        lane = self.lane(page)
        self.held(lane, hold=2.0)
        self.gateway.user("remove", "anna")
        lane.until_end()
        self.stands_for_good()
        self.was_halted(f"anna via {OWN_NAME}")
        self.assertEqual(page.session()[0], 401)


if __name__ == "__main__":
    unittest.main()
