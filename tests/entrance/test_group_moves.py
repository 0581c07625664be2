"""A move of axes of three machines, whose clocks are an hour apart: when they start, and who stops them."""
import concurrent.futures
import os
import re
import threading
import time
import unittest
import uuid

import grpc

from harness import Program, feeder, group_pb, pb, run, wait_for
from harness.programs import AXISCTL
from harness.wire import START, STOP
from support import HOST, PRESENT, CellScenario, cell_pb, error_pb

HOUR = 3600
PULSES = 2000  # per mm
#: What a busy computer takes more, until the frame of a stop is at the drive.
BUSY = 0.5
#: After the last renewal that a machine got. An entrance hears of a failure with the next one, and a tick later; that a
#: machine is lost, when one was not answered.
UNRENEWED, HEARD, LOST = 0.5, 0.2, 0.65


class Gate(grpc.GenericRpcHandler):
    """In front of an axisd: passes calls on, but for those that `holds` says of, which it keeps for ever. `passed`: methods
    of those that were answered."""

    def __init__(self, target, address):
        self.holds = lambda method, request: False
        self.held = threading.Event()
        self.passed = []
        self._end = threading.Event()
        self._channel = grpc.insecure_channel(target)
        self._server = grpc.server(concurrent.futures.ThreadPoolExecutor(16), handlers=(self,))
        self.address = f"{address}:{self._server.add_insecure_port(f'{address}:0')}"
        self._server.start()

    def service(self, handler_call_details):
        method = handler_call_details.method
        metadata = [(key, value) for key, value in handler_call_details.invocation_metadata
                    if key.startswith("axisd-") and key not in ("axisd-hops", "axisd-machine")]

        def forward(request, context):
            if self.holds(method.rpartition("/")[2], request):
                self.held.set()
                self._end.wait()
                context.abort(grpc.StatusCode.CANCELLED, "held")
            try:
                answer = self._channel.unary_unary(method)(request, timeout=context.time_remaining(), metadata=metadata)
                self.passed.append((method.rpartition("/")[2], request))
                return answer
            except grpc.RpcError as error:
                context.set_trailing_metadata(tuple(item for item in error.trailing_metadata() or ()
                                                    if item[0] == "grpc-status-details-bin"))
                return context.abort(error.code(), error.details())
        return grpc.unary_unary_rpc_method_handler(forward)

    def close(self):
        self._end.set()
        self._server.stop(0).wait()
        self._channel.close()


class GroupMoves(CellScenario):
    def setUp(self):
        super().setUp()
        self.presses = [self.press_of(number) for number in (1, 2, 3)]

    def press_of(self, number):
        """Its clock is an hour more ahead than that of the one before; what simulates its drive is not."""
        machine = self.machine({"feeder": feeder()}, name=f"press-{number}")
        machine.start_lines()
        ahead = str((number - 1) * HOUR)
        machine.start_daemon(before=("/usr/bin/unshare", "-T" if os.geteuid() == 0 else "-rT", "--boottime", ahead,
                                     "--monotonic", ahead))
        machine.client.wait_online("feeder")
        machine.client.to_done("Enable", "feeder")
        machine.client.to_done("SetPosition", "feeder", position=0.0)
        return machine

    def entrance_of(self, machine, addresses=None):
        others = {press.name: (addresses or {}).get(press.name, f"unix:{press.socket}")
                  for press in self.presses if press is not machine}
        peers = ", ".join(f"{name}: {{ axisd: \"{address}\" }}" for name, address in others.items())
        entrance = self.entrance(machine, keys=f"peers: {{ {peers} }}")
        wait_for(lambda: [m.state for m in entrance.machines().values()] == [PRESENT] * 3, "all are there")
        return entrance

    def gate(self, machine):
        gate = Gate(f"unix:{machine.socket}", HOST)
        self.addCleanup(gate.close)
        return gate

    def request(self, position, velocity=50.0, until=pb.WAIT_UNTIL_DONE, **keys):
        targets = [{"axis": "feeder", "position": position, "velocity": velocity}]
        return cell_pb.MoveGroupRequest(
            machines=[{"machine": press.name, "targets": targets} for press in self.presses],
            options={"request_id": str(uuid.uuid4()), "wait_until": until}, clock_tolerance={"nanos": 20_000_000}, **keys)

    def move(self, entrance, request):
        return entrance.client.call(entrance.client.cell.MoveGroup, request, timeout=60).move

    def told(self, entrance):
        """How moves came along, by the entrance's events."""
        return [event.group_move for event in entrance.events() if event.kind == cell_pb.CELL_EVENT_KIND_GROUP_MOVE]

    def steps(self, entrance):
        return [cell_pb.GroupMoveStep.Name(move.step).removeprefix("GROUP_MOVE_STEP_") for move in self.told(entrance)]

    def starts(self):
        return [press.sim.shaft().starts for press in self.presses]

    def moving(self):
        return [press.sim.shaft().moving for press in self.presses]

    def all_stand(self):
        """For good."""
        wait_for(lambda: not any(self.moving()), "all stand")
        places, starts = [press.sim.shaft().position for press in self.presses], self.starts()
        time.sleep(1.5)
        self.assertEqual([press.sim.shaft().position for press in self.presses], places)
        self.assertEqual(self.starts(), starts)
        self.assertTrue(all(count <= 1 for count in starts), starts)

    def stops(self, since, presses=None):
        """When the first stop was at each drive, in seconds after `since` (time.monotonic_ns())."""
        frames = [press.sim.wire.writes(STOP, since=since) for press in presses or self.presses]
        self.assertTrue(all(frames), frames)
        return [(each[0].time - since) / 1e9 for each in frames]

    def start_frames(self, wire_of):
        """Of each machine the time of its only start frame."""
        frames = [wire_of(press).writes(START) for press in self.presses]
        self.assertEqual([len(each) for each in frames], [1, 1, 1])
        return [each[0].time for each in frames]

    def test_three_axes_start_at_one_moment(self):
        entrance = self.entrance_of(self.presses[0])
        request = self.request(60.0)
        move = self.move(entrance, request)
        self.assertEqual(move.state, pb.COMMAND_STATE_DONE, move)
        self.assertEqual(self.starts(), [1, 1, 1])
        self.assertEqual(self.steps(entrance), ["PREPARED", "STARTED", "DONE"])
        for event in self.told(entrance):
            self.assertEqual((event.request_id, list(event.machines)),
                             (request.options.request_id, [press.name for press in self.presses]))
        self.assertEqual((event.start_skew, event.start_skew_error), (move.start_skew, move.start_skew_error))
        self.assertEqual([press.sim.shaft().position for press in self.presses], [60 * PULSES] * 3)
        bound = move.start_skew_error.ToNanoseconds()
        for number, part in enumerate(move.machines):
            known_to = part.clock_error.ToNanoseconds()
            self.assertTrue(0 < known_to <= 20_000_000, move)
            self.assertLessEqual(abs(part.clock_offset.ToNanoseconds() - number * HOUR * 10**9), known_to, move)
        sent = self.start_frames(lambda press: press.wire)
        sent = [at - number * HOUR * 10**9 for number, at in enumerate(sent)]
        skew, seen = move.start_skew.ToNanoseconds(), max(sent) - min(sent)
        # Where a frame ends is known within what a busy computer takes to say so.
        self.assertLessEqual(abs(skew - seen), bound + 2_000_000, move)
        self.assertLess(skew, 60_000_000, move)  # each misses its moment by at most 50 ms
        drives = self.start_frames(lambda press: press.sim.wire)
        for at_drive, at_line in zip(drives, sent):
            self.assertGreaterEqual(at_drive, at_line)  # it arrives after it was sent: the clocks are told apart
        print(f"skew {skew / 1e6:.3f} ms, known to {bound / 1e6:.3f} ms; lines {seen / 1e6:.3f} ms, "
              f"drives {(max(drives) - min(drives)) / 1e6:.3f} ms")

    def test_what_forbids_one_moves_nobody(self):
        entrance = self.entrance_of(self.presses[0])
        request = self.request(60.0)
        request.machines[1].targets[0].position = 900.0
        detail = self.refused("OUT_OF_RANGE", "SOFT_LIMIT", self.move, entrance, request)
        self.assertTrue(detail.message.startswith("press-2: feeder"), detail)
        self.assertEqual(self.steps(entrance), ["FAILED"])
        self.assertEqual(self.told(entrance)[0].cause, detail)
        for press in self.presses:
            press.client.wait_state("feeder", lambda s: s.state == pb.STATE_STANDSTILL, "it is free again")
        self.assertEqual(self.starts(), [0, 0, 0])
        self.refused("NOT_FOUND", "INVALID_ARGUMENT", self.move, entrance, cell_pb.MoveGroupRequest(
            machines=[{"machine": "press-9", "targets": [{"axis": "feeder", "position": 1.0}]}],
            options={"request_id": "nobody"}))

    def test_a_repeat_moves_once_through_any_entrance(self):
        here, there = self.entrance_of(self.presses[0]), self.entrance_of(self.presses[1])
        request = self.request(60.0, velocity=30.0)
        with concurrent.futures.ThreadPoolExecutor() as pool:
            first = pool.submit(self.move, here, request)
            wait_for(lambda: all(self.moving()), "all move")
            again, elsewhere = pool.submit(self.move, here, request), pool.submit(self.move, there, request)
            moves = [each.result() for each in (first, again, elsewhere)]
        self.assertEqual([move.state for move in moves], [pb.COMMAND_STATE_DONE] * 3, moves)
        self.assertEqual(len({tuple(part.move.id for part in move.machines) for move in moves}), 1)
        self.assertEqual(self.starts(), [1, 1, 1])
        request.machines[0].targets[0].position = 61.0
        self.refused("ALREADY_EXISTS", "REQUEST_ID_CONFLICT", self.move, here, request)

    def test_what_one_entrance_gives_up_goes_on_where_another_one_has_told_it(self):
        slow = self.gate(self.presses[2])
        slow.holds = lambda method, _: method == "RenewPrepared"
        here, there = self.entrance_of(self.presses[0]), self.entrance_of(self.presses[1], {"press-3": slow.address})
        request = self.request(60.0, velocity=30.0)
        with concurrent.futures.ThreadPoolExecutor() as pool:
            elsewhere = pool.submit(self.move, there, request)
            self.assertTrue(slow.held.wait(30), "it asks press-3 for its clock, and gives up 0.45 s later")
            moves = [pool.submit(self.move, here, request).result(), elsewhere.result()]
        self.assertEqual([move.state for move in moves], [pb.COMMAND_STATE_DONE] * 2, moves)
        self.assertEqual(self.starts(), [1, 1, 1])
        self.assertEqual([press.sim.shaft().position for press in self.presses], [60 * PULSES] * 3)

    def test_what_one_entrance_has_given_up_starts_through_no_other_one(self):
        slow = self.gate(self.presses[2])
        slow.holds = lambda method, _: method == "RenewPrepared"
        here, there = self.entrance_of(self.presses[0]), self.entrance_of(self.presses[1], {"press-3": slow.address})
        request = self.request(60.0)
        self.refused("DEADLINE_EXCEEDED", "OFFLINE", self.move, there, request)
        self.assertEqual(self.move(here, request).state, pb.COMMAND_STATE_ABORTED)
        for press in self.presses:
            self.assertEqual(press.client.state("feeder").state, pb.STATE_STANDSTILL)
        self.assertEqual(self.starts(), [0, 0, 0])

    def test_all_stand_where_the_coordinator_is_killed_in_motion(self):
        entrance = self.entrance_of(self.presses[0])
        move = self.move(entrance, self.request(390.0, velocity=20.0, until=pb.WAIT_UNTIL_STARTED))
        self.assertEqual(move.state, pb.COMMAND_STATE_ACTIVE, move)
        self.assertEqual(self.moving(), [True] * 3)
        killed = time.monotonic_ns()
        entrance.kill()
        self.all_stand()
        stops = self.stops(killed)
        self.assertLess(max(stops), UNRENEWED + BUSY)
        self.assertGreater(min(stops), 0.1)  # it was renewed until then
        print(f"stops at the drives {stops} s after the coordinator was killed")
        for press, part in zip(self.presses, move.machines):
            ended = press.client.call(press.client.group.GetGroupMove, group_pb.GetGroupMoveRequest(id=part.move.id)).move
            self.assertEqual((ended.state, ended.cause.reason), (pb.COMMAND_STATE_ABORTED, error_pb.REASON_EXPIRED))

    def killed_where(self, holds, passes):
        """The coordinator is killed when press-3 is to get a call that `holds`, which it never gets, and press-2 got what
        `passes` says of a list of calls."""
        second, third = (self.gate(press) for press in self.presses[1:])
        entrance = self.entrance_of(self.presses[0], {"press-2": second.address, "press-3": third.address})
        third.holds = holds
        with concurrent.futures.ThreadPoolExecutor() as pool:
            moving = pool.submit(entrance.client.cell.MoveGroup, self.request(390.0, velocity=20.0), timeout=60)
            self.assertTrue(third.held.wait(30), "the call came")
            wait_for(lambda: passes(second.passed), "press-2 has its call")
            killed = time.monotonic_ns()
            entrance.kill()
            self.assertIsInstance(moving.exception(), grpc.RpcError)
        return killed

    def test_nobody_starts_where_the_coordinator_is_killed_between_the_starts(self):
        self.killed_where(lambda method, _: method == "StartPrepared",
                          lambda passed: any(method == "StartPrepared" for method, _ in passed))
        for press in self.presses:
            press.client.wait_state("feeder", lambda s: s.state == pb.STATE_STANDSTILL, "it is free again")
            self.assertEqual(press.sim.wire.writes(START), [])
        self.assertEqual(self.starts(), [0, 0, 0])

    def test_all_stand_where_it_is_killed_between_the_words_that_all_were_told(self):
        def is_word(method, request):
            return method == "RenewPrepared" and group_pb.RenewPreparedRequest.FromString(request).all_told
        # After the third word those who heard are renewed until after their moment; 0.15 s later press-3 would be lost.
        killed = self.killed_where(is_word, lambda passed: sum(is_word(*call) for call in list(passed)) >= 3)
        wait_for(lambda: all(self.starts()[:2]), "who heard has started")
        self.all_stand()
        self.assertLess(max(self.stops(killed, self.presses[:2])), UNRENEWED + BUSY)
        self.assertEqual(self.starts(), [1, 1, 0])
        self.assertEqual(self.presses[2].sim.wire.writes(START), [])

    def test_a_member_that_fails_stops_the_others(self):
        entrance = self.entrance_of(self.presses[0])
        with concurrent.futures.ThreadPoolExecutor() as pool:
            moving = pool.submit(self.move, entrance, self.request(390.0, velocity=20.0))
            wait_for(lambda: all(self.moving()) and "STARTED" in self.steps(entrance), "all move, as the entrance knows")
            self.presses[1].sim.control("alarm 1 1")
            failed = time.monotonic_ns()
            self.all_stand()
            move = moving.result()
        self.assertEqual(move.state, pb.COMMAND_STATE_ERROR, move)
        self.assertTrue(move.cause.message.startswith("press-2: feeder"), move)
        self.assertEqual(self.steps(entrance), ["PREPARED", "STARTED", "FAILED", "HALTED"])
        stops = self.stops(failed, (self.presses[0], self.presses[2]))
        self.assertLess(max(stops), HEARD + BUSY)
        print(f"stops at the other drives {stops} s after one had an alarm")

    def test_a_machine_that_is_lost_stops_the_others(self):
        gate = self.gate(self.presses[2])
        entrance = self.entrance_of(self.presses[0], {"press-3": gate.address})
        with concurrent.futures.ThreadPoolExecutor() as pool:
            moving = pool.submit(self.move, entrance, self.request(390.0, velocity=20.0))
            wait_for(lambda: all(self.moving()) and "STARTED" in self.steps(entrance), "all move, as the entrance knows")
            gate.holds = lambda method, _: True
            lost = time.monotonic_ns()
            self.all_stand()
            move = moving.result()
        self.assertEqual(move.state, pb.COMMAND_STATE_UNKNOWN, move)
        self.assertTrue(move.cause.message.startswith("press-3: "), move)
        self.assertEqual(self.steps(entrance), ["PREPARED", "STARTED", "FAILED", "UNKNOWN"])
        stops = self.stops(lost)
        self.assertLess(max(stops[:2]), LOST + BUSY)
        self.assertLess(stops[2], UNRENEWED + BUSY)  # by its own machine

    def test_axisctl_moves_them(self):
        entrance = self.entrance_of(self.presses[0])
        following = Program("axisctl-events", [AXISCTL, "--cell", entrance.address, "events", "--follow"],
                            self.presses[0].directory)
        self.addCleanup(following.kill)
        wait_for(lambda: "press-3 is present" in following.output(), "it follows")
        done = run([AXISCTL, "--cell", entrance.address, "group", "move", "press-1/feeder=20mm", "press-3/feeder=30mm@60mm/s",
                    "--clock-tolerance", "20ms", "--wait"], limit=60)
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)
        self.assertRegex(done.stdout, r"(?s)done\n.*press-1/feeder +Done.*press-3/feeder +Done.*start skew .* at most")
        self.assertEqual(self.starts(), [1, 0, 1])
        refused = run([AXISCTL, "--cell", entrance.address, "group", "move", "press-1/feeder=30mm", "press-2/feeder=900mm"],
                      limit=60)
        self.assertNotEqual(refused.returncode, 0)
        self.assertIn("press-2: feeder", refused.stderr)
        lines = wait_for(lambda: re.findall(r"  cell  move of (press-1, press-\d) by \S+: (\w+)(.*)", following.output())
                         if "failed" in following.output() else None, "it tells how they came along")
        self.assertEqual([line[:2] for line in lines], [("press-1, press-3", "prepared"), ("press-1, press-3", "started"),
                                                        ("press-1, press-3", "done"), ("press-1, press-2", "failed")])
        self.assertRegex(lines[1][2], r"^, skew \d+\.\d+ ms, off by \d+\.\d+ ms at most$")
        self.assertTrue(lines[3][2].startswith(": press-2: feeder"), lines)
        self.assertEqual(self.starts(), [1, 0, 1])


if __name__ == "__main__":
    unittest.main()
