"""What the tests of axisctl share: the program's path, running it, running it on a terminal."""
import json
import os
import pty
import re
import select
import signal
import subprocess
import time
import unittest

import between
import simulated  # makes axisd importable
import axisd

AXISCTL = os.environ["AXISCTL"]  # set by CTest
LIMIT = 60  # s; generous, the machine may be busy


def environment():
    """The test's own: no server, certificates or colours from outside."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("AXISD_", "NO_COLOR", "GRPC_"))}
    return kept | {"TERM": "xterm"}


class PythonTest(unittest.IsolatedAsyncioTestCase):
    """The Python package's connection to a daemon with simulated drives, and what is between them."""

    async def asyncSetUp(self):
        (self.daemon,) = simulated.daemons("press-1")
        self.between = between.Between(self.daemon.server)
        self.server, port = await self.between.start()
        self.addAsyncCleanup(self.between.channel.close)
        self.addAsyncCleanup(self.server.stop, 0)
        self.machine = await self.enterAsyncContext(axisd.connect(f"127.0.0.1:{port}"))
        self.feeder = self.machine.axis("feeder")

    def calls(self, method):
        return self.between.requests(method)


class AxisctlTest(unittest.TestCase):
    """axisctl, a daemon with simulated drives, and what is between them."""

    def setUp(self):
        (self.daemon,) = simulated.daemons("press-1")
        self.server = self.enterContext(between.Passage(self.daemon.server))

    def run_axisctl(self, *words, server=None, env=None):
        return subprocess.run([AXISCTL, "--server", server or self.server.address, *words], capture_output=True,
                              text=True, timeout=LIMIT, env=environment() | (env or {}), check=False)

    def ok(self, *words):
        """Standard output of a run that must succeed."""
        done = self.run_axisctl(*words)
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)
        return done.stdout

    def fails(self, code, *words, **arguments):
        """The one line on standard error of a run that must fail with this code."""
        done = self.run_axisctl(*words, **arguments)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        self.assertRegex(done.stderr, r"\Aaxisctl: [^\n]+\n\Z")
        return done.stderr.strip()

    def json(self, *words):
        """The objects of a successful run with --json."""
        return [json.loads(line) for line in self.ok("--json", *words).splitlines()]

    def wait_for_call(self, method):
        """Until the daemon has seen a call of this method."""
        for _ in range(LIMIT * 100):
            if self.server.calls(method):
                return
            time.sleep(0.01)
        self.fail(f"no call of {method}")

    def on_terminal(self, *words, interrupt_at=None, env=None):
        return on_terminal(self, [AXISCTL, "--server", self.server.address, *words], interrupt_at, env)


def on_terminal(test, command, interrupt_at=None, env=None):
    """Runs on a terminal; sends SIGINT, as Ctrl-C does, once the output matches. Returns status and output."""
    ours, theirs = pty.openpty()
    # Not pty.fork: a fork of a process with gRPC's threads may hang.
    axisctl = subprocess.Popen(command, env=environment() | (env or {}), stdin=theirs, stdout=theirs, stderr=theirs,
                               close_fds=True)
    os.close(theirs)
    test.addCleanup(axisctl.kill)
    shown, interrupted, deadline = "", False, time.monotonic() + LIMIT
    while time.monotonic() < deadline:
        if select.select([ours], [], [], 0.1)[0]:
            try:
                shown += os.read(ours, 65536).decode(errors="replace")
            except OSError:  # Linux ends a pseudo terminal with EIO
                break
        if interrupt_at is not None and not interrupted and re.search(interrupt_at, shown, re.DOTALL):
            axisctl.send_signal(signal.SIGINT)
            interrupted = True
    os.close(ours)
    return axisctl.wait(LIMIT), shown
