"""Leases by axisctl and by the Python package, against the daemon with simulated drives."""
import asyncio
import signal
import subprocess
import sys
import unittest
from unittest import mock

from between import Between
from support import AXISCTL, LIMIT, AxisctlTest, PythonTest, environment
import axisd

from harness.programs import OWN_NAME

SHOW = ("import os, sys, time; print(os.environ['AXISD_LEASE'], os.environ['AXISD_SERVER'] != '', flush=True); "
        "time.sleep(float(sys.argv[1])); sys.exit(int(sys.argv[2]))")


class Axisctl(AxisctlTest):
    def test_acquire_prints_the_token_alone(self):
        token = self.ok("lease", "acquire", "feeder", "turntable", "--ttl", "20s", "--label", "panel 2").strip()
        self.assertRegex(token, r"^\d+$")
        (request,) = self.server.calls("AcquireLease")
        self.assertEqual((list(request.axes), request.ttl.seconds, request.label, request.take),
                         (["feeder", "turntable"], 20, "panel 2", False))
        self.assertTrue(request.request_id)
        self.assertRegex(self.ok("lease", "list"), rf"feeder, turntable +{OWN_NAME} \(panel 2\) +\S+ s +20 s")
        self.assertEqual(self.json("lease", "list")[0]["leases"][0]["client"], OWN_NAME)
        self.assertIn("feeder, turntable: leased for another", self.ok("lease", "renew", token))
        self.assertEqual(self.ok("lease", "release", token), "released\n")
        self.assertEqual(self.ok("lease", "list"), "no leases\n")
        self.assertIn("the lease was released", self.fails(4, "lease", "renew", token))
        self.assertIn("'abc' is no token; a token is a number", self.fails(2, "lease", "renew", "abc"))

    def test_held_axes_are_refused_or_taken(self):
        first = int(self.ok("lease", "acquire", "feeder", "--label", "a"))
        self.assertIn(f"leased by {OWN_NAME}", self.fails(4, "lease", "acquire", "feeder"))
        done = self.run_axisctl("lease", "acquire", "feeder", "--take")
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, f"{first + 1}\n", f"taken from {OWN_NAME} (a): feeder\n"))

    def test_commands_carry_the_token(self):
        token = int(self.ok("lease", "acquire", "feeder"))
        self.ok("move", "feeder", "1", "--lease", str(token))
        self.assertIn("there is no lease with this token", self.fails(4, "move", "feeder", "2", env={"AXISD_LEASE": "8"}))
        self.run_axisctl("drive", "write", "feeder", "current=5", env={"AXISD_LEASE": "9"})
        self.assertEqual([request.options.lease_token for request in self.server.calls("MoveAbsolute")], [token, 8])
        self.assertEqual([request.lease_token for request in self.server.calls("WriteParameters")], [9])

    def test_hold_renews_while_the_program_runs_and_ends_as_it_does(self):
        done = self.run_axisctl("lease", "hold", "feeder,turntable", "--ttl", "3s", "--", sys.executable, "-c",
                                SHOW, "2.5", "3")
        (released,) = self.server.calls("ReleaseLease")
        self.assertEqual((done.returncode, done.stdout, done.stderr), (3, f"{released.lease_token} True\n", ""))
        self.assertGreaterEqual(len(self.server.calls("RenewLease")), 2)
        self.assertEqual(list(self.server.calls("AcquireLease")[0].axes), ["feeder", "turntable"])

    def test_hold_says_that_the_lease_was_lost(self):
        holding = subprocess.Popen([AXISCTL, "--server", self.server.address, "lease", "hold", "feeder", "--ttl", "3s",
                                    "--", sys.executable, "-c", SHOW, "2.5", "0"], env=environment(), text=True,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.addCleanup(holding.kill)
        self.assertRegex(holding.stdout.readline(), r"^\d+ True\n")
        self.daemon.take("feeder")
        _, errors = holding.communicate(timeout=LIMIT)
        self.assertEqual(holding.returncode, 4)
        self.assertEqual(errors.count(f"axisctl: lease lost: {OWN_NAME} took the lease"), 1, errors)
        self.assertEqual(self.server.calls("ReleaseLease"), [])

    def test_hold_passes_on_signals_and_releases(self):
        holding = subprocess.Popen([AXISCTL, "--server", self.server.address, "lease", "hold", "feeder", "--",
                                    sys.executable, "-c", SHOW, "60", "0"], env=environment(), text=True,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.addCleanup(holding.kill)
        self.assertRegex(holding.stdout.readline(), r"^\d+ True\n")
        holding.send_signal(signal.SIGTERM)
        self.assertEqual(holding.wait(LIMIT), 128 + signal.SIGTERM)
        self.assertEqual(len(self.server.calls("ReleaseLease")), 1)
        holding.communicate()

    def test_hold_of_a_program_that_is_not_there(self):
        self.assertIn("cannot run '/nowhere'", self.fails(2, "lease", "hold", "feeder", "--", "/nowhere"))
        self.assertEqual(len(self.server.calls("ReleaseLease")), 1)


class Python(PythonTest):
    async def test_commands_inside_carry_the_token(self):
        async with self.machine.lease("feeder", "turntable", ttl=3, label="cell 4") as lease:
            self.assertEqual((lease.info.axes, lease.info.label, lease.info.ttl), (("feeder", "turntable"), "cell 4", 3))
            feeder = lease.axis("feeder")
            await feeder.move(5)
            await lease.axis("turntable").drive.write(current=3)
            while len(self.calls("RenewLease")) < 2:
                await asyncio.sleep(0.05)
            self.assertEqual([held.client for held in await self.machine.leases()], [OWN_NAME])
        self.assertEqual(self.calls("MoveAbsolute")[0].options.lease_token, lease.token)
        self.assertEqual(self.calls("WriteParameters")[0].lease_token, lease.token)
        self.assertEqual(len(self.calls("ReleaseLease")), 1)
        await self.machine.axis("feeder").move(6)
        self.assertEqual(self.calls("MoveAbsolute")[1].options.lease_token, 0)

    async def test_a_lost_lease_ends_the_block(self):
        reached = []
        with self.assertRaisesRegex(axisd.LeaseLostError, "took the lease"):
            async with self.machine.lease("feeder", ttl=3):
                self.daemon.take("feeder")
                await asyncio.sleep(LIMIT)
                reached.append("the end")
        self.assertEqual((reached, self.calls("ReleaseLease")), ([], []))
        await asyncio.sleep(0)  # no cancellation is left over

    async def test_a_daemon_that_is_gone_ends_the_block_within_the_ttl(self):
        server, port = await Between(self.daemon.server).start()
        async with axisd.connect(f"127.0.0.1:{port}") as machine:
            with self.assertRaises(axisd.LeaseLostError):
                async with machine.lease("feeder", ttl=3):
                    await server.stop(0)
                    await asyncio.sleep(LIMIT)

    async def test_renewals_that_cannot_be_sent_end_the_block(self):
        with self.assertRaisesRegex(axisd.LeaseLostError, "the lease was not renewed: no such method"):
            async with self.machine.lease("feeder", ttl=0.3):
                with mock.patch.object(self.machine, "_attempt", side_effect=AttributeError("no such method")):
                    await asyncio.sleep(LIMIT)

    async def test_the_blocks_own_errors_and_cancellations_stay(self):
        with self.assertRaises(ZeroDivisionError):
            async with self.machine.lease("feeder"):
                raise ZeroDivisionError
        with self.assertRaises(TimeoutError):
            async with asyncio.timeout(0.1):
                async with self.machine.lease("feeder"):
                    await asyncio.sleep(LIMIT)
        self.assertEqual(len(self.calls("ReleaseLease")), 2)

    async def test_axes_of_others_are_refused_or_taken(self):
        async with self.machine.lease("feeder"):
            with self.assertRaises(axisd.RefusedError) as raised:
                async with self.machine.lease("feeder"):
                    self.fail("it has two holders")
            self.assertEqual(raised.exception.reason, "lease_required")
        with self.assertRaises(axisd.LeaseLostError):
            async with self.machine.lease("feeder", ttl=3):
                async with self.machine.lease("feeder", take=True) as second:
                    self.assertEqual(second.taken[0].axes, ("feeder",))
                    await asyncio.sleep(LIMIT)


if __name__ == "__main__":
    unittest.main()
