"""The base of the scenarios on CAN."""
from .can import Candump, LinkHelper, Peer
from .case import Scenario
from .client import pb
from .machine import turntable
from .programs import wait_for

CONTROL_WORD, TARGET_VELOCITY, HALT = 0x6040, 0x60FF, 1 << 8


class CanScenario(Scenario):
    """Axes `table` (node 5) and `second` (node 6), a YSS-C each, on one network."""

    def idle_cell(self, axes=None, interface="vcan0", helper=None, **keys):
        """A machine of which nothing runs yet. `helper`: links that axisd-link may touch; `keys` of the network."""
        return self.machine(axes or {"table": turntable(5), "second": turntable(6)},
                            networks={"can0": {"interface": interface, **keys}},
                            link_helper=self.helper(*helper) if helper else None)

    def cell(self, simulator=(), **arguments):
        """A machine that is ready, with everything enabled at 0 deg. `simulator`: options of start_line()."""
        machine = self.idle_cell(**arguments)
        machine.start_line("can0", *simulator)
        machine.start_daemon()
        for axis in machine.axes:
            machine.client.wait_online(axis)
        for axis in machine.axes:
            machine.client.to_done("Enable", axis)
            machine.client.to_done("SetPosition", axis, position=0.0)
        return machine

    def helper(self, *links):
        helper = LinkHelper(*links)
        self.addCleanup(helper.close)
        return helper.socket

    def candump(self, interface="vcan0"):
        dump = Candump(interface)
        self.addCleanup(dump.close)
        return dump

    def peer(self, interface="vcan0"):
        peer = Peer(interface)
        self.addCleanup(peer.close)
        return peer

    def mid_move(self, machine, axis="table", position=7000.0):
        command = machine.client.motion("MoveAbsolute", axis, position=position)
        machine.client.wait_state(axis, lambda s: s.position > 10 or machine.client.has_ended(command),
                                  f"{axis} is in mid-move")
        command = machine.client.get_command(command)
        self.assert_command(command, "ACTIVE")
        return command

    def ended(self, machine, command):
        """A motion that was interrupted: not done, with a cause that says what to do."""
        command = machine.client.wait_ended(command)
        self.assertNotEqual(command.state, pb.COMMAND_STATE_DONE, command)
        self.assertTrue(command.cause.message and command.cause.remedy, command)
        return command

    def offline(self, machine, axis="table"):
        """The axis's state once it is offline, with a cause."""
        state = machine.client.wait_state(axis, lambda s: s.link == pb.LINK_STATE_OFFLINE, f"{axis} is offline")
        self.assertTrue(state.link_error.message and state.link_error.remedy, state)
        return state

    def stopped(self, machine, axis="table", starts=1):
        """Back online, in ErrorStop, and the shaft rests; nothing was started since."""
        state = machine.client.wait_online(axis)
        machine.sim.wait_rest(state.node)
        state = machine.client.wait_state(axis, lambda s: not s.moving, f"{axis} is known to rest")
        self.assert_state(state, "ERROR_STOP")
        self.assertTrue(state.fault.message and state.fault.remedy, state)
        self.assertEqual(machine.sim.shaft(state.node).starts, starts)
        return state

    def stop_is_first(self, machine, since, node=5):
        """The first frames to a node that might move, after its link came back, stop it: bit 8 of the control
        word, before which velocity 0 may be written. Returns the time of the halt."""
        def halts():
            for frame in machine.frames.frames("tx", since=since, cob_id=0x600 + node):
                if frame.object and frame.object[0] == CONTROL_WORD:
                    return frame
            return None
        halt = wait_for(halts, f"a control word to node {node}")
        self.assertTrue(halt.object[2] & HALT, halt)
        for frame in machine.frames.frames("tx", since=since, until=halt.time, cob_id=halt.id):
            if frame.object:
                self.assertIn(frame.object[0], (TARGET_VELOCITY, 0x605D), frame)
                self.assertEqual(frame.object[2], 0, frame)
        return halt.time

    def link_times(self, machine, state, since):
        return [at for at, name in machine.frames.links() if name == state and at >= since]

    def usable_again(self, machine, *axes):
        """After a reset each axis moves when it is told to, and by no other means."""
        for axis in axes or machine.axes:
            machine.client.wait_online(axis)
            if machine.client.state(axis).state == pb.STATE_ERROR_STOP:
                machine.client.to_done("Reset", axis)
            if not machine.client.state(axis).enabled:
                machine.client.to_done("Enable", axis)
            before = machine.client.state(axis).position
            machine.client.to_done("MoveRelative", axis, distance=5.0)
            self.assertAlmostEqual(machine.client.state(axis).position, before + 5, delta=0.05)
