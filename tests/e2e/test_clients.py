"""Clients that vanish, repeat themselves, cancel and watch."""
import threading
import time
import unittest

import grpc

from harness import (AXISCTL, DONE, ENDED, START, STARTED, STOP, Program, Scenario, axis_pb, command_pb, feeder, pb,
                     spinner, wait_for)


class Killed(Scenario):
    def start_axisctl(self, machine, *words):
        program = Program("axisctl", [AXISCTL, "--server", f"unix:{machine.socket}", *words], machine.directory)
        self.addCleanup(program.kill)
        return program

    def test_while_jogging(self):
        machine = self.ready_feeder()
        program = self.start_axisctl(machine, "jog", "feeder", "10mm/s")
        # It jogs for as long as it is renewed.
        state = machine.client.wait_state("feeder", lambda s: s.position > 8.0 and s.moving, "jogging beyond one hold")
        command = machine.client.get_command(pb.Command(id=state.command_id))
        self.assertEqual(command.kind, pb.COMMAND_KIND_JOG)
        program.kill()
        self.assert_command(machine.client.wait_ended(command), "ABORTED")
        machine.sim.wait_rest()
        state = machine.client.wait_state("feeder", lambda s: s.state == pb.STATE_STANDSTILL, "halted by itself")
        self.assertLess(state.position, 390, "it ran to the soft limit")
        self.assertEqual(len(machine.wire.writes(STOP, 0)), 1)

    def test_in_mid_move(self):
        machine = self.ready_feeder()
        program = self.start_axisctl(machine, "move", "feeder", "200mm", "--wait")
        state = machine.client.wait_state("feeder", lambda s: s.position > 20.0, "in mid-move")
        program.kill()
        command = machine.client.wait_ended(pb.Command(id=state.command_id))
        self.assert_command(command, "DONE")
        self.assertEqual(machine.sim.shaft().position, 400000)
        self.assertEqual(machine.wire.writes(STOP), [])

    def test_deadline_of_the_call(self):
        """The call ends early, the command does not."""
        machine = self.ready_feeder()
        client = machine.connect()
        request = axis_pb.MoveAbsoluteRequest(axis="feeder", position=200.0,
                                              options={"request_id": "late", "wait_until": DONE})
        with self.assertRaises(grpc.RpcError) as ended:
            client.axis.MoveAbsolute(request, timeout=0.5)
        self.assertEqual(ended.exception.code(), grpc.StatusCode.DEADLINE_EXCEEDED)
        # The same request again finds the command, and waits for it.
        self.assert_command(client.call(client.axis.MoveAbsolute, request).command, "DONE")
        self.assertEqual(len(machine.wire.writes(START)), 1)


class Idle(Scenario):
    def test_its_stop_gets_through(self):
        """gRPC looks at a connection without calls every 5 s only, so it answers the daemon's pings that late."""
        machine = self.ready_spinner()
        machine.client.motion("MoveVelocity", "spinner", velocity=1.0)
        quiet = time.monotonic_ns()
        wait_for(lambda: machine.wire.requests(since=quiet + 6_000_000_000), "6 s without a call")
        self.assert_command(machine.client.motion("Stop", "spinner", wait=DONE), "DONE")
        self.assertFalse(machine.sim.shaft().moving)


class Commands(Scenario):
    def test_request_id(self):
        machine = self.ready_feeder()
        client = machine.client
        first = client.motion("MoveAbsolute", "feeder", position=50.0, request_id="one")
        again = client.motion("MoveAbsolute", "feeder", position=50.0, request_id="one", wait=DONE)
        self.assertEqual(first.id, again.id)
        self.assert_command(again, "DONE")
        detail = self.refused("ALREADY_EXISTS", "REQUEST_ID_CONFLICT", client.motion, "MoveAbsolute", "feeder",
                              position=51.0, request_id="one")
        self.assertTrue(detail.remedy)
        after = client.motion("MoveAbsolute", "feeder", position=50.0, request_id="one", wait=DONE)
        self.assertEqual(after.id, first.id)
        self.assertEqual(len(machine.wire.writes(START)), 1)
        # From another connection of the same client, too.
        self.assertEqual(machine.connect().motion("MoveAbsolute", "feeder", position=50.0, request_id="one").id, first.id)
        self.refused("INVALID_ARGUMENT", "INVALID_ARGUMENT", client.motion, "MoveAbsolute", "feeder", position=1.0,
                     request_id="")

    def test_cancel(self):
        machine = self.ready_feeder()
        client = machine.client
        move = self.move_under_way(machine)
        seen = []
        stream = client.command.WatchCommand(command_pb.WatchCommandRequest(id=move.id))
        reader = threading.Thread(target=lambda: seen.extend(update.command for update in stream), daemon=True)
        reader.start()
        wait_for(lambda: seen, "the first state of the command")
        client.call(client.command.CancelCommand, command_pb.CancelCommandRequest(id=move.id))
        ended = self.assert_command(client.wait_ended(move), "ABORTED")
        reader.join(60)  # the stream ends with its command
        self.assertFalse(reader.is_alive())
        self.assertEqual(seen[0].state, pb.COMMAND_STATE_ACTIVE)
        self.assertEqual(seen[-1], ended)
        client.wait_state("feeder", lambda s: s.state == pb.STATE_STANDSTILL, "halted")
        self.assertFalse(machine.sim.shaft().moving)
        # A command that has ended is left alone, and so is what runs now.
        other = self.move_under_way(machine, position=1.0, beyond=-1)
        client.call(client.command.CancelCommand, command_pb.CancelCommandRequest(id=move.id))
        self.assert_command(client.wait_ended(other), "DONE")
        self.refused("NOT_FOUND", "UNKNOWN_COMMAND", client.get_command, pb.Command(id="nothing"))

    def test_watch_to_the_end(self):
        machine = self.ready_feeder()
        client = machine.client
        move = client.motion("MoveAbsolute", "feeder", position=30.0)
        states = [update.command.state for update in
                  client.command.WatchCommand(command_pb.WatchCommandRequest(id=move.id), timeout=60)]
        self.assertEqual(states, sorted(states))
        self.assertEqual(states[-1], pb.COMMAND_STATE_DONE)
        # Of one that has ended already: its end, once.
        again = [update.command for update in
                 client.command.WatchCommand(command_pb.WatchCommandRequest(id=move.id), timeout=60)]
        self.assertEqual(again, [client.get_command(move)])

    def test_wait_until_started(self):
        machine = self.ready_feeder()
        command = machine.client.motion("MoveAbsolute", "feeder", position=100.0, wait=STARTED)
        self.assert_command(command, "ACTIVE")
        self.assertEqual(len(machine.wire.writes(START)), 1)
        self.assertNotIn(command.state, ENDED)
        self.assert_command(machine.client.wait_ended(command), "DONE")

    def test_jog_is_renewed(self):
        machine = self.machine({"spinner": spinner()}).start()
        client = machine.client
        client.to_done("Enable", "spinner")
        jog = client.motion("Jog", "spinner", velocity=2.0, hold=2.0, request_id="jog")
        client.wait_state("spinner", lambda s: s.moving, "it moves")
        # A repeat extends the hold; without one it halts, and a repeat that comes too late starts nothing.
        first = time.monotonic()
        while time.monotonic() < first + 3:
            again = client.motion("Jog", "spinner", velocity=2.0, hold=2.0, request_id="jog")
            self.assertEqual(again.id, jog.id)
        self.assertNotIn(again.state, ENDED)
        self.assert_command(client.wait_ended(jog), "ABORTED")
        self.assert_command(client.motion("Jog", "spinner", velocity=2.0, hold=2.0, request_id="jog"), "ABORTED")
        client.wait_state("spinner", lambda s: s.state == pb.STATE_STANDSTILL, "halted")
        self.assertFalse(machine.sim.shaft().moving)
        self.assertEqual(len(machine.wire.writes(START)), 1)

    def test_held_velocity(self):
        machine = self.ready_spinner()
        command = machine.client.motion("MoveVelocity", "spinner", velocity=-5.0, hold=1.0, wait=DONE)
        self.assert_command(command, "ABORTED")
        machine.sim.wait_rest()
        self.assertLess(machine.sim.shaft().position, 0)


class Watching(Scenario):
    def test_chosen_fields(self):
        machine = self.machine({"feeder": feeder()}).start()
        done = machine.axisctl("watch", "--count", "2", "--fields", "link,fault.message,position")
        self.assertEqual(done.stdout, "1  feeder link=LINK_STATE_ONLINE fault.message=- position=0\n"
                                      "2  feeder link=LINK_STATE_ONLINE fault.message=- position=0\n")
        done = machine.axisctl("watch", "--fields", "position,speed")
        self.assertEqual((done.returncode, done.stdout), (4, ""))
        self.assertRegex(done.stderr, 'AxisState has no field "speed"; known are axis, unit, state, .*, lease_holder')


LIST_SERVICES = b"\x3a\x01*"
REFLECTION = "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo"


class StandardServices(Scenario):
    def test_health(self):
        machine = self.machine({"feeder": feeder()}).start()
        channel = machine.client.channel
        check = channel.unary_unary("/grpc.health.v1.Health/Check")
        self.assertEqual(check(b"", timeout=60), b"\x08\x01")  # SERVING
        name = b"axisd.v1.AxisService"
        self.assertEqual(check(b"\x0a" + bytes([len(name)]) + name, timeout=60), b"\x08\x01")
        with self.assertRaises(grpc.RpcError) as unknown:
            check(b"\x0a\x01x", timeout=60)
        self.assertEqual(unknown.exception.code(), grpc.StatusCode.NOT_FOUND)

    def test_reflection_is_off(self):
        machine = self.machine({"feeder": feeder()}).start()
        reflect = machine.client.channel.stream_stream(REFLECTION)
        with self.assertRaises(grpc.RpcError) as off:
            list(reflect(iter([LIST_SERVICES]), timeout=60))
        self.assertEqual(off.exception.code(), grpc.StatusCode.UNIMPLEMENTED)


if __name__ == "__main__":
    unittest.main()
