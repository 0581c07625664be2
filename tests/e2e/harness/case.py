"""The base of all scenarios."""
import sys
import unittest

import grpc

from .client import CallFailed, pb
from .machine import Machine, feeder, spinner


class Scenario(unittest.TestCase):
    """Ends what a test started, and shows all logs when it failed."""

    maxDiff = None

    def setUp(self):
        self._machines = []

    def run(self, result=None):
        before = len(result.failures) + len(result.errors) if result else 0
        super().run(result)
        failed = result and len(result.failures) + len(result.errors) > before
        for machine in getattr(self, "_machines", []):
            if failed:
                print(f"##### logs of {self.id()}{machine.logs()}", file=sys.stderr)
            machine.remove()
        self._machines = []
        return result

    def machine(self, axes, **arguments):
        """A machine that is ended with the test."""
        machine = Machine(axes, **arguments)
        self._machines.append(machine)
        self.addCleanup(machine.close)
        return machine

    def refused(self, code, reason, function, *arguments, **keywords):
        """The ErrorDetail of a call that must fail like this."""
        with self.assertRaises(CallFailed) as caught:
            function(*arguments, **keywords)
        failure = caught.exception
        self.assertEqual((failure.code, failure.reason), (getattr(grpc.StatusCode, code), f"REASON_{reason}"), failure)
        self.assertTrue(failure.detail.message and failure.message, failure)
        return failure.detail

    def assert_state(self, state, name):
        self.assertEqual(pb.State.Name(state.state), f"STATE_{name}", state)

    def assert_command(self, command, name):
        self.assertEqual(pb.CommandState.Name(command.state), f"COMMAND_STATE_{name}", command)
        return command

    def ready_feeder(self, **keys):
        """One axis `feeder`, enabled, at 0 mm, its position declared."""
        machine = self.machine({"feeder": feeder(**keys)}).start()
        machine.client.to_done("Enable", "feeder")  # first: a motor without current can be turned by hand
        machine.client.to_done("SetPosition", "feeder", position=0.0)
        return machine

    def ready_spinner(self, **keys):
        """One endless axis `spinner`, enabled."""
        machine = self.machine({"spinner": spinner(**keys)}).start()
        machine.client.to_done("Enable", "spinner")
        return machine

    def move_under_way(self, machine, position=300.0, beyond=20.0, **fields):
        """A move of the feeder that has come past `beyond` mm."""
        command = machine.client.motion("MoveAbsolute", "feeder", position=position, **fields)
        machine.client.wait_state("feeder", lambda s: s.position > beyond, "the feeder is in mid-move")
        return command
