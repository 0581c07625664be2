"""Virtual CAN links that go down, away and bus-off while drives move."""
import time
import unittest

from harness import CanScenario, error_pb, ip, turntable, wait_for


class Links(CanScenario):
    def interrupted(self, machine, breaks, mends):
        """Both axes are interrupted in mid-move by `breaks`, and found by `mends`; returns when it broke."""
        table, second = self.mid_move(machine), self.mid_move(machine, "second")
        broken = time.monotonic_ns()
        breaks()
        for axis, command in (("table", table), ("second", second)):
            self.offline(machine, axis)
            self.ended(machine, command)
        mends()
        self.stop_is_first(machine, self.up_after(machine, broken), 5)
        self.stop_is_first(machine, self.up_after(machine, broken), 6)
        self.stopped(machine)
        self.stopped(machine, "second")
        self.usable_again(machine)
        return broken

    def up_after(self, machine, since):
        return wait_for(lambda: self.link_times(machine, "up", since), "the link is up again")[0]

    def test_down_and_up(self):
        machine = self.cell()
        broken = self.interrupted(machine, lambda: ip("link set vcan0 down"), lambda: ip("link set vcan0 up"))
        # Nothing was said to be sent while it was down, and nothing was sent later.
        self.assertTrue(self.link_times(machine, "down", broken))
        up = self.up_after(machine, broken)
        down = self.link_times(machine, "down", broken)[0]
        self.assertEqual(machine.frames.frames("tx", since=down, until=up), [])

    def test_deleted_and_created_anew(self):
        machine = self.cell()
        broken = self.interrupted(machine, lambda: ip("link del vcan0"),
                                  lambda: ip("link add vcan0 type vcan", "link set vcan0 up"))
        self.assertTrue(self.link_times(machine, "removed", broken))

    def test_bus_off_is_cycled_by_the_helper(self):
        machine = self.cell(helper=["vcan0"])
        peer = self.peer()
        table = self.mid_move(machine)
        broken = time.monotonic_ns()
        peer.report_bus_off()
        self.ended(machine, table)
        up = self.up_after(machine, broken)
        self.assertLess(self.link_times(machine, "bus_off", broken)[0], up)
        self.stop_is_first(machine, up)
        self.stopped(machine)
        self.usable_again(machine)

    def test_without_a_helper_the_cause_is_clear(self):
        machine = self.cell()
        helper = machine.client.buses()[0].network.link_helper_error  # told while the link is sound
        self.assertIn("there is no link helper", helper.message)
        self.assertIn("axisd-link.socket", helper.remedy)
        self.assertIn("there is no link helper", machine.daemon.log())
        peer = self.peer()
        table = self.mid_move(machine)
        broken = time.monotonic_ns()
        peer.report_bus_off()
        state = self.offline(machine)
        self.assertEqual(state.link_error.reason, error_pb.REASON_BUS_DOWN, state)
        self.assertIn("bus-off", state.link_error.message)
        self.assertIn("ip link set vcan0", state.link_error.remedy)
        self.ended(machine, table)
        off = wait_for(lambda: self.link_times(machine, "bus_off", broken), "the bus-off is logged")[0]
        ip("link set vcan0 down", "link set vcan0 up")  # by hand
        up = self.up_after(machine, broken)
        self.assertEqual(machine.frames.frames("tx", since=off, until=up), [])
        self.stop_is_first(machine, up)
        self.stopped(machine)

    def test_missing_at_the_start(self):
        machine = self.idle_cell({"table": turntable()}, interface="cell7")
        machine.start_daemon()  # is ready without it
        state = self.offline(machine)
        self.assertIn("cell7", state.link_error.message)
        self.assertIn("there is no CAN interface cell7", machine.daemon.log())
        ip("link add cell7 type vcan")
        self.addCleanup(ip, "link del cell7")
        machine.client.wait_state("table", lambda s: "down" in s.link_error.message, "it is there, but down")
        ip("link set cell7 up")
        machine.start_line("can0")
        machine.client.wait_online("table")
        self.assertEqual(machine.sim.shaft(5).starts, 0)


if __name__ == "__main__":
    unittest.main()
