"""The real axisd with simulated drives, for tests of its clients: one daemon for a file of tests, put in order before each.

Axes: `feeder` (mm, soft limits 0 to 400, enabled, homed, at 0), `turntable` (deg, disabled), `sticky` (mm, enabled), and `ghost`,
whose drive has no power. Velocities are granted as whole r/min: in steps of 8/3 mm/s.
"""
import atexit
import concurrent.futures
import os
import pathlib
import shutil
import sys
import tempfile

import grpc

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "e2e"))
from harness.client import ENDED, CallFailed, Client, axis_pb, command_pb, group_pb, lease_pb, pb, system_pb  # noqa: E402  (makes axisd importable)
from harness.machine import PATIENT  # noqa: E402
from harness.programs import AXISCTL, AXISD, OWN_NAME, Program, run, wait_for  # noqa: E402

AXES = ("feeder", "turntable", "ghost", "sticky")
SCALE = "    scale: { microstep: 8000 pulses/rev, travel: 160 mm/rev }\n"
LIMITS = "velocity: 600 mm/s, acceleration_time: 50 ms"
CONFIG = f"""machine: MACHINE
access:
  roles: {{ "{OWN_NAME}": maintainer }}
  delegates: {{ "{OWN_NAME}": maintainer }}
  axes: {{ ghost: {{ roles: {{ "{OWN_NAME}": operator }} }} }}
buses:
  line-a: {{ modbus_rtu: {{ port: sim, turnaround_max: 200 ms }} }}
  line-b: {{ modbus_rtu: {{ port: sim, turnaround_max: 200 ms }} }}
axes:
  feeder:
    bus: line-a
    node: 1
    model: ykd2405pr
    unit: mm
{SCALE}    limits: {{ position: [0, 400], {LIMITS} }}
    homing: {{ method: home_negative, velocity: 300 mm/s, search_velocity: 30 mm/s, max_travel: 2000 mm, backoff: 25 mm }}
    inputs: {{ X0: home }}
    jog_travel: 200 mm
    simulate: {{ home_switch: -20, home_width: 20, start_position: 10 }}
  turntable:
    bus: line-a
    node: 2
    model: ykd2405pr
    unit: deg
    scale: {{ microstep: 10000 pulses/rev, gear: 2/1, modulo: 360 }}
    limits: {{ velocity: 720 deg/s }}
    homing: {{ method: home_positive, velocity: 180 deg/s, search_velocity: 30 deg/s, max_travel: 800 deg, backoff: 20 deg }}
    inputs: {{ X0: home }}
    simulate: {{ home_switch: 20, home_width: 10, enabled_at_power_up: false }}
  ghost:
    bus: line-b
    node: 9
    model: ykd2405pr
    unit: mm
{SCALE}    limits: {{ {LIMITS} }}
  sticky:
    bus: line-a
    node: 3
    model: ssd2608pr
    unit: mm
    scale: {{ microstep: 4000 pulses/rev, travel: 160 mm/rev }}
    limits: {{ {LIMITS} }}
    require_trust: false
groups: {{ transfer: {{ axes: [feeder, turntable] }} }}
"""


class Daemon:
    """`wait`: until its drives are there."""

    def __init__(self, machine):
        self.directory = pathlib.Path(tempfile.mkdtemp(prefix="axisd-clients-"))
        atexit.register(self.close)
        self.server = f"unix:{self.directory}/axisd.sock"
        config = self.directory / "press.yaml"
        patience = "".join(f"    {key}: {text}\n" for key, text in PATIENT.items())
        config.write_text(CONFIG.replace("MACHINE", machine).replace("    limits:", f"{patience}    limits:"))
        self.program = Program("axisd", [AXISD, "--config", str(config), "--state-directory", str(self.directory / "state"),
                                         "--listen", self.server], self.directory)

    def wait(self):
        wait_for(self._listens, "it listens")
        for axis in AXES:
            self.client.wait_online(axis)
        self.power("ghost", False)

    def _listens(self):
        assert self.program.running(), self.program.log()
        if not os.path.exists(self.server.removeprefix("unix:")):
            return False
        self.client = Client(self.server)
        try:
            return self.client.states()
        except CallFailed as failed:  # the socket has its name before anybody listens
            if failed.code != grpc.StatusCode.UNAVAILABLE:
                raise
            self.client.close()
            return False

    def simulate(self, *words):
        done = run([AXISCTL, "--server", self.server, "sim", *words])
        assert done.returncode == 0, done.stderr

    def power(self, axis, on):
        """The supply of its drive."""
        self.simulate("power", axis, "on" if on else "off")
        link = pb.LINK_STATE_ONLINE if on else pb.LINK_STATE_OFFLINE
        self.client.wait_state(axis, lambda s: s.link == link, "its drive is there, or gone")

    def take(self, *axes):
        """The lease of these, from whoever has it; returns its token."""
        return self.client.call(self.client.lease.AcquireLease,
                                lease_pb.AcquireLeaseRequest(axes=axes, take=True)).lease_token

    def leases(self):
        return list(self.client.call(self.client.lease.ListLeases, lease_pb.ListLeasesRequest()).leases)

    def hold(self, axis, request_id, user=None):
        """As another program does, or another user."""
        self.client.axis.Stop(axis_pb.StopRequest(axis=axis, hold=True, options={"request_id": request_id}),
                              metadata=(("axisd-user", user),) if user else ())

    def put_in_order(self):
        """However the test before has left it."""
        call = self.client.call
        if self.client.info().inhibited:
            call(self.client.system.ReleaseStopAll, system_pb.ReleaseStopAllRequest())
        if self.leases():
            call(self.client.lease.ReleaseLease, lease_pb.ReleaseLeaseRequest(lease_token=self.take(*AXES)))
        states = {state.axis: state for state in self.client.states()}
        held = [name for name, state in states.items() if state.holds]
        if held:
            call(self.client.group.GroupReleaseStop, group_pb.GroupReleaseStopRequest(axes=held, everybody=True))
        for name in ("feeder", "turntable", "sticky"):
            self._rest(name, states[name], powered=name != "turntable")
        feeder = states["feeder"]
        if feeder.trust != pb.POSITION_TRUST_HOMED:
            self._do("Home", "feeder")
        if self.client.state("feeder").position != 0:
            self._do("MoveAbsolute", "feeder", position=0.0)

    def _do(self, name, axis, **fields):
        """To its end, once what a test has left undone has ended."""
        def done():
            try:
                return self.client.to_done(name, axis, **fields)
            except CallFailed as failed:
                if failed.reason != "REASON_BUSY":
                    raise
                return None
        wait_for(done, f"{name} of {axis}")

    def _busy(self, state):
        if state.state not in (pb.STATE_STANDSTILL, pb.STATE_DISABLED, pb.STATE_ERROR_STOP):
            return True
        return state.command_id and self.client.call(self.client.command.GetCommand,
                                command_pb.GetCommandRequest(id=state.command_id)).command.state not in ENDED

    def _rest(self, name, state, powered):
        if state.moving or self._busy(state):
            self._do("Stop", name)
            state = self.client.state(name)
        if state.state == pb.STATE_ERROR_STOP:
            self._do("Reset", name)
        if state.enabled != powered or not state.enabled_by_daemon and powered:
            self._do("Enable" if powered else "Disable", name)

    def close(self):
        self.program.kill()  # its end would wait for the stop that it owes the ghost
        self.program.check_memory()
        shutil.rmtree(self.directory, ignore_errors=True)


_daemons = {}


def daemons(*machines):
    """Those of this file of tests, in order."""
    new = [name for name in machines if name not in _daemons]
    _daemons.update({name: Daemon(name) for name in new})
    with concurrent.futures.ThreadPoolExecutor() as each:
        list(each.map(Daemon.wait, [_daemons[name] for name in new]))
        list(each.map(Daemon.put_in_order, [_daemons[name] for name in machines]))
    return [_daemons[name] for name in machines]
