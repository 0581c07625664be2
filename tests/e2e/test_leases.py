"""Who may command an axis: a holder that hangs, and one that runs a program."""
import pathlib
import signal
import sys
import unittest

from harness import OWN_NAME, START, STOP, Program, Scenario, bus_pb, error_pb, lease_pb, pb, wait_for
from harness.programs import AXISCTL, AXISD_SIM
from lease_holder import TTL


class Leases(Scenario):
    def stop_bound(self, machine):
        """What the daemon publishes for the last frame of a stop of this axis alone, ns."""
        (budget,) = machine.client.call(machine.client.bus.GetBudget, bus_pb.GetBudgetRequest()).budgets
        return budget.axes[0].stop_alone.last_frame.ToNanoseconds()

    def acquire(self, client, **fields):
        return client.call(client.lease.AcquireLease, lease_pb.AcquireLeaseRequest(axes=["feeder"], **fields))

    @staticmethod
    def lease_events(machine):
        lines = machine.axisctl("events", "--kind", "lease").stdout.splitlines()
        return [line.split("feeder  ")[1] for line in lines]

    def test_a_holder_that_is_held_up_loses_the_axis(self):
        machine = self.ready_feeder()
        holder = Program("holder", [sys.executable, "-B", str(pathlib.Path(__file__).with_name("lease_holder.py")),
                                    machine.socket], machine.directory, {"AXISD_SIM": AXISD_SIM})
        self.addCleanup(holder.kill)
        token, move, before, after = wait_for(lambda: holder.output().endswith("\n") and holder.output(),
                                              "the holder stops").split()[1:]
        state = machine.client.wait_state("feeder", lambda s: not s.lease_holder and not s.moving, "the axis halted")
        self.assert_state(state, "STANDSTILL")
        self.assertTrue(state.enabled, state)
        self.assertFalse(machine.sim.shaft().moving)
        # The halt, by the daemon's wire log and by the simulator's: not before the lease ended, nor later than the bus's
        # published bound after that.
        ends = int(TTL * 1e9)
        for frames in (machine.wire.writes(STOP, since=int(before)), machine.sim.wire.writes(STOP, since=int(before))):
            self.assertGreaterEqual(frames[0].time, int(before) + ends)
            self.assertLessEqual(frames[0].time, int(after) + ends + self.stop_bound(machine))
        aborted = self.assert_command(machine.client.get_command(pb.Command(id=move)), "ABORTED")
        self.assertEqual(aborted.cause.reason, error_pb.REASON_LEASE_LOST, aborted)

        other = machine.connect()
        second = self.acquire(other, label="second", ttl={"seconds": 60}).lease_token
        self.assertGreater(second, int(token))
        other.to_done("MoveAbsolute", "feeder", position=5.0, options={"lease_token": second})
        starts = len(machine.wire.writes(START))
        holder.process.send_signal(signal.SIGCONT)
        self.assertEqual(holder.wait(), 0, holder.log())
        late = holder.output().splitlines()[-1]
        self.assertTrue(late.startswith("refused ABORTED REASON_LEASE_LOST"), late)
        self.assertIn(f"leased by {OWN_NAME} (second) for another", late)
        self.assertEqual(len(machine.wire.writes(START)), starts)
        self.assertEqual(machine.sim.shaft().position, 10000)
        self.assertEqual(self.lease_events(machine), [f"leased by {OWN_NAME} (e2e)", f"lease of {OWN_NAME} (e2e) expired",
                                                      f"leased by {OWN_NAME} (second)"])

    def test_axisctl_holds_a_lease_while_a_program_runs(self):
        machine = self.ready_feeder()
        done = machine.axisctl("lease", "hold", "feeder", "--ttl", "1s", "--", AXISCTL, "move", "feeder", "30mm",
                               "--velocity", "20mm/s", "--wait")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(machine.sim.shaft().position, 60000)
        self.assertEqual(machine.axisctl("lease", "list").stdout, "no leases\n")
        self.assertEqual(self.lease_events(machine), [f"leased by {OWN_NAME}", f"lease released by {OWN_NAME}"])

    def test_stops_need_no_lease(self):
        machine = self.ready_feeder()
        token = self.acquire(machine.client, ttl={"seconds": 60}).lease_token
        self.move_under_way(machine, options={"lease_token": token})
        self.refused("PERMISSION_DENIED", "LEASE_REQUIRED", machine.client.motion, "MoveAbsolute", "feeder", position=1.0)
        done = machine.axisctl("stop", "feeder", "--wait")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertFalse(machine.sim.shaft().moving)


if __name__ == "__main__":
    unittest.main()
