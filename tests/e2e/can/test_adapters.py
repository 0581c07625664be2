"""A genuine controller interface (slcan) between the daemon and its drives: bus-off, a stalled adapter, bit rates."""
import time
import unittest

from harness import CanScenario, Peer, SlcanAdapter, error_pb, turntable, wait_for

CONTROL_WORD, HALT = 0x6040, 1 << 8


class Adapter(CanScenario):
    """The drives are on vcan1; the adapter is the wire between."""

    def adapter(self, bitrate=1_000_000):
        adapter = SlcanAdapter(bitrate)
        self.addCleanup(adapter.close)
        return adapter

    def wired_cell(self):
        adapter = self.adapter()
        wire = Peer("vcan1")
        adapter.join(wire)
        return adapter, self.cell(axes={"table": turntable()}, interface=adapter.interface, simulator=("vcan1",),
                                  helper=[adapter.interface])

    def test_bus_off_in_mid_move(self):
        """M26: stopped within 200 ms. The guest has a time of its own, which this computer's load does not take."""
        adapter, machine = self.wired_cell()
        move = self.mid_move(machine)
        starts = machine.sim.shaft(5).starts
        broken = time.monotonic_ns()
        adapter.say("sb000256")
        self.ended(machine, move)
        off = wait_for(lambda: self.link_times(machine, "bus_off", broken), "the bus-off is seen")[0]
        up = wait_for(lambda: self.link_times(machine, "up", off), "the link is up again")[0]
        stopped = self.stop_is_first(machine, up)
        self.assertLess(stopped - off, 200_000_000)
        # Nothing was handed over in between, and nothing comes out later.
        self.assertEqual(machine.frames.frames("tx", since=off, until=up), [])
        self.stopped(machine, starts=starts)
        self.usable_again(machine)

    def test_what_a_stalled_adapter_did_not_take_is_never_sent(self):
        adapter, machine = self.wired_cell()
        move = self.mid_move(machine)
        adapter.stall(True)
        self.ended(machine, move)
        state = self.offline(machine)
        self.assertEqual(state.link_error.reason, error_pb.REASON_BUS_DOWN, state)
        starts = machine.sim.shaft(5).starts
        # While the adapter stands still, a command is refused and not kept.
        self.refused("FAILED_PRECONDITION", "FAULT", machine.client.motion, "MoveAbsolute", "table", position=1.0)
        since = time.monotonic_ns()
        adapter.stall(False)
        up = wait_for(lambda: self.link_times(machine, "up", since), "the helper has set the link up again")[0]
        self.stop_is_first(machine, up)
        self.stopped(machine, starts=starts)
        self.usable_again(machine)

    def test_quiesce_on_a_bus_that_is_off(self):
        """The daemon was killed, and the controller gave up: the link is cycled, then the drive stopped."""
        adapter, machine = self.wired_cell()
        self.mid_move(machine)
        machine.daemon.kill()
        adapter.say("sb000256")
        result = machine.quiesce()
        self.assertEqual((result.returncode, result.stdout), (0, "table: standstill confirmed\n"), result)
        self.assertFalse(machine.sim.shaft(5).moving)

    def test_another_bit_rate(self):
        adapter = self.adapter(250_000)
        machine = self.idle_cell({"table": turntable()}, interface=adapter.interface, bitrate=500_000)
        machine.start_daemon()
        state = machine.client.wait_state("table", lambda s: s.link_error.reason == error_pb.REASON_MISCONFIGURED,
                                          "the bit rate is objected to")
        for figure in ("250000", "500000"):
            self.assertIn(figure, state.link_error.message)
        self.assertEqual(machine.frames.frames("tx"), [])
        self.assertEqual(adapter.taken(), [])


if __name__ == "__main__":
    unittest.main()
