"""Drives that restart, fall silent, complain, answer late or shout, while they and their neighbours move."""
import time
import unittest

from harness import DONE, CanScenario, CanSimulator, EndlessNode, bus_pb, error_pb, pb, turntable, wait_for

CONTROL_WORD = 0x6040


class Nodes(CanScenario):
    """What happens to `table` (node 5) is no business of `second` (node 6)."""

    def neighbour_unharmed(self, machine, move):
        """The neighbour's move, begun before the trouble, goes on and is told to go elsewhere."""
        state = machine.client.state("second")
        self.assertEqual((state.link, state.enabled), (pb.LINK_STATE_ONLINE, True), state)
        self.assertNotEqual(state.state, pb.STATE_ERROR_STOP, state)
        self.assertFalse(machine.client.get_command(move).HasField("cause"))
        machine.client.to_done("Halt", "second")
        self.usable_again(machine, "second")

    def test_restarts_in_mid_move(self):
        machine = self.cell()
        neighbour = self.mid_move(machine, "second")
        move = self.mid_move(machine)
        since = time.monotonic_ns()
        machine.sim.control("fault reboot node=5")
        ended = self.ended(machine, move)
        self.assertEqual(ended.cause.reason, error_pb.REASON_REBOOTED, ended)
        state = machine.client.wait_state("table", lambda s: s.drive_reboots == 1 and s.link == pb.LINK_STATE_ONLINE,
                                          "the restart is reported")
        self.assertEqual((state.trust, state.enabled), (pb.POSITION_TRUST_UNKNOWN, False), state)
        # Nobody enables or starts it: 0Fh is the only control word that does.
        words = [frame.object[2] for frame in machine.frames.writes(CONTROL_WORD, node=5, kind="tx", since=since)]
        self.assertFalse([word for word in words if word & 0x0F == 0x0F and not word & 0x100], words)
        self.assertEqual(machine.sim.shaft(5)[1:], (False, 1))
        self.neighbour_unharmed(machine, neighbour)
        self.usable_again(machine, "table")

    def test_falls_silent_in_mid_move(self):
        machine = self.cell()
        neighbour = self.mid_move(machine, "second")
        move = self.mid_move(machine)
        machine.sim.control("fault silence node=5")
        state = self.offline(machine)
        self.assertEqual(state.link_error.node, 5, state)
        self.ended(machine, move)
        self.neighbour_unharmed(machine, neighbour)
        self.assertTrue(machine.sim.shaft(5).moving, "the scenario is void: it stands before it is heard again")
        since = time.monotonic_ns()
        machine.sim.control("fault clear")
        self.stop_is_first(machine, since)
        self.stopped(machine)
        self.usable_again(machine, "table")

    def test_reports_an_alarm_by_emcy(self):
        machine = self.cell()
        neighbour = self.mid_move(machine, "second")
        move = self.mid_move(machine)
        machine.sim.control("alarm 5 2")  # overvoltage; it needs no power cycle
        ended = self.ended(machine, move)
        self.assertEqual(ended.cause.reason, error_pb.REASON_ALARM, ended)
        machine.sim.wait_rest(5)
        state = machine.client.wait_state("table", lambda s: s.alarm_code == 2, "the alarm is shown")
        self.assert_state(state, "ERROR_STOP")
        self.assertTrue(machine.frames.frames("rx", cob_id=0x085), "the drive sent no EMCY")
        self.neighbour_unharmed(machine, neighbour)
        machine.sim.control("alarm 5 0")
        machine.client.wait_state("table", lambda s: s.alarm_code == 0, "the alarm is gone")
        self.usable_again(machine, "table")

    def test_answers_late(self):
        """Longer than the SDO time-out: whoever waited for it knows that, and nothing is done twice."""
        machine = self.cell()
        neighbour = self.mid_move(machine, "second")
        machine.sim.control("fault delay_reply node=5 delay_ms=2500 count=2")
        move = machine.client.motion("MoveAbsolute", "table", position=90.0, wait=DONE)
        ended = time.monotonic_ns()
        self.assertLessEqual(machine.sim.shaft(5).starts, 1)
        if move.state != pb.COMMAND_STATE_DONE:
            self.assertTrue(move.cause.message and move.cause.remedy, move)
        machine.client.wait_online("table")
        machine.sim.wait_rest(5)
        self.assertLessEqual(machine.sim.shaft(5).starts, 1)
        self.neighbour_unharmed(machine, neighbour)
        wait_for(lambda: len(machine.frames.frames("rx", since=ended, cob_id=0x585)) >= 2, "its late answers have come")
        self.usable_again(machine, "table")

    def test_floods_the_bus(self):
        """With the highest priority that a node has. What moves goes on or is stopped; a stop gets through."""
        # As fast as this bit rate lets frames follow each other: 900 a second.
        machine = self.cell(simulator=("vcan0", 125_000))
        self.mid_move(machine, "second")
        self.mid_move(machine)
        machine.sim.control("fault flood node=5 cob=0x001 delay_ms=1500")
        for axis in ("second", "table"):
            stop = machine.client.motion("Stop", axis, wait=DONE)
            self.assert_command(stop, "DONE")
        for node in (5, 6):
            machine.sim.wait_rest(node)
        starts = [machine.sim.shaft(node).starts for node in (5, 6)]
        wait_for(lambda: self.quiet(machine), "the flood is over")
        for axis in ("table", "second"):
            machine.client.wait_online(axis)
        self.assertEqual([machine.sim.shaft(node).starts for node in (5, 6)], starts)
        self.usable_again(machine)

    @staticmethod
    def quiet(machine):
        last = machine.frames.frames("rx", cob_id=0x001)
        return last and time.monotonic_ns() - last[-1].time > 300_000_000


class EndOfTheDaemon(CanScenario):
    def test_in_order(self):
        machine = self.cell()
        self.mid_move(machine)
        self.assertEqual(machine.daemon.terminate(), 0)
        self.assertFalse(machine.sim.shaft(5).moving)

    def test_quiesce_after_a_crash(self):
        """The drives have no watchdog: they go on until they are stopped from outside."""
        machine = self.cell()
        self.mid_move(machine)
        self.mid_move(machine, "second")
        machine.daemon.kill()
        result = machine.quiesce()
        self.assertEqual((result.returncode, sorted(result.stdout.splitlines())),
                         (0, ["second: standstill confirmed", "table: standstill confirmed"]), result)
        for node in (5, 6):
            self.assertFalse(machine.sim.shaft(node).moving)
        # Found at rest, nothing is started again.
        machine.start_daemon()
        machine.client.wait_online("table")
        self.assertEqual(machine.sim.shaft(5)[1:], (False, 1))


class WrongNodes(CanScenario):
    def test_another_identity(self):
        machine = self.idle_cell({"table": turntable()})
        machine.start_line("can0").poke(0x101801, 0x0BAD, node=5)
        machine.start_daemon()
        state = machine.client.wait_state("table", lambda s: s.link_error.reason == error_pb.REASON_WRONG_MODEL,
                                          "the identity is refused")
        self.assertTrue(state.link_error.message and state.link_error.remedy, state)
        self.assertEqual(machine.frames.writes(CONTROL_WORD, kind="tx"), [])
        self.refused("FAILED_PRECONDITION", "WRONG_MODEL", machine.client.motion, "Enable", "table")

    def test_two_nodes_with_one_id(self):
        """Both answer each request: what one of them says is not what the other does."""
        machine = self.idle_cell({"table": turntable()})
        machine.start_line("can0")
        other = CanSimulator("clash", machine.directory, ["node=5,model=yss-c"], "vcan0")
        self.addCleanup(other.close)
        machine.start_daemon()
        state = machine.client.wait_state("table", lambda s: s.link_error.reason == error_pb.REASON_MISCONFIGURED,
                                          "the clash is noticed")
        self.assertIn("answered twice", state.link_error.message)
        self.assertIn("node-ID", state.link_error.remedy)
        self.assertEqual(machine.frames.writes(CONTROL_WORD, kind="tx"), [])
        self.assertEqual((machine.sim.shaft(5).starts, other.shaft(5).starts), (0, 0))

    def test_uploads_without_an_end(self):
        """Whoever asks is told why there is no value, the transfer is aborted, and the axis beside it goes on."""
        machine = self.cell(axes={"table": turntable()})
        move = self.mid_move(machine)
        for size, reason, abort in ((7, "OUT_OF_RANGE", 0x05040005), (0, "NO_REPLY", 0x05040000)):
            with self.subTest(size=size):
                node = EndlessNode("vcan0", 9, size)
                self.addCleanup(node.close)
                detail = self.refused("OUT_OF_RANGE" if size else "UNAVAILABLE", reason, machine.client.call,
                                      machine.client.bus.Transact, bus_pb.TransactRequest(
                                          bus="can0", node=9, address=0x100800, read_object={}))
                self.assertEqual((detail.node, detail.object), (9, 0x100800), detail)
                wait_for(lambda node=node: node.aborts == [abort], "the transfer is aborted")
                node.close()
        self.assertFalse(machine.client.get_command(move).HasField("cause"))
        machine.client.to_done("Halt", "table")
        self.usable_again(machine)


if __name__ == "__main__":
    unittest.main()
