"""One imaginary axis of the fake daemon, and how it refuses."""
import asyncio
import pathlib
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "e2e"))
from google.protobuf import field_mask_pb2  # noqa: E402
from client import package  # noqa: E402

package.load()
from axisd.v1 import error_pb2, types_pb2  # noqa: E402

ENDS = (types_pb2.COMMAND_STATE_DONE, types_pb2.COMMAND_STATE_ABORTED, types_pb2.COMMAND_STATE_ERROR,
        types_pb2.COMMAND_STATE_UNKNOWN)
STEP = 0.01  # s between positions of a moving axis


async def refuse(context, code, detail, text=None):
    """Ends the call with the typed detail in the standard trailer."""
    packed = error_pb2.StatusDetails.Packed(type_url="type.googleapis.com/axisd.v1.ErrorDetail",
                                            value=detail.SerializeToString())
    details = error_pb2.StatusDetails(code=code.value[0], message=detail.message, details=[packed])
    await context.abort(code, text or detail.message, (("grpc-status-details-bin", details.SerializeToString()),))


class FakeAxis:
    def __init__(self, machine, name, unit, node, limits=None):
        self.machine, self.name, self.limits = machine, name, limits
        self.task = None
        self.current = None
        self.state = types_pb2.AxisState(
            axis=name, unit=unit, state=types_pb2.STATE_DISABLED, link=types_pb2.LINK_STATE_ONLINE,
            trust=types_pb2.POSITION_TRUST_UNKNOWN, position_source=types_pb2.POSITION_SOURCE_COMMANDED,
            simulated=True, bus="line-a", node=node, model="ykd2405pr", drive_version="1.0",
            start_note="its bus has no common trigger",
            inputs=[types_pb2.Terminal(name="X0", function="home", active=False)],
            outputs=[types_pb2.Terminal(name="Y0", function="alarm", active=False)])
        if name == "turntable":
            self.state.drift, self.state.eeprom_writes = "X1 has no function", 12
            self.state.moving, self.state.motion_cause = True, types_pb2.MOTION_CAUSE_TERMINAL
        if name == "ghost":
            self.state.link = types_pb2.LINK_STATE_OFFLINE
            self.state.link_error.CopyFrom(offline_detail())

    def snapshot(self, fields=()):
        state = types_pb2.AxisState()
        state.CopyFrom(self.state)
        state.measured_at.GetCurrentTime()
        state.age.FromMilliseconds(5)
        state.inhibited = self.machine.inhibited
        if not fields:
            return state
        chosen = types_pb2.AxisState()
        field_mask_pb2.FieldMask(paths=["axis", *fields]).MergeMessage(state, chosen)
        return chosen

    def end(self, state, cause=None):
        """Ends the current command, and with it the motion."""
        if self.task is not None and self.task is not asyncio.current_task():
            self.task.cancel()
        self.task = None
        if self.current is not None and self.current.state not in ENDS:
            self.machine.change(self.current, state, cause)
        self.current = None
        self.state.velocity = 0
        self.state.moving = False

    def begin(self, command, work):
        self.end(types_pb2.COMMAND_STATE_ABORTED, error_pb2.ErrorDetail(
            reason=error_pb2.REASON_SUPERSEDED, message="a newer command took its place"))
        self.current = command
        self.state.command_id = command.id
        self.task = asyncio.create_task(work)

    async def travel(self, command, target, velocity, state):
        self.machine.change(command, types_pb2.COMMAND_STATE_ACTIVE)
        self.state.state = state
        self.state.moving = True
        start, distance = self.state.position, target - self.state.position
        self.state.velocity = velocity if distance >= 0 else -velocity
        duration = abs(distance) / velocity
        begun = time.monotonic()
        while (passed := time.monotonic() - begun) < duration:
            self.state.position = start + distance * passed / duration
            await asyncio.sleep(STEP)
        self.state.position = target
        self.state.state = types_pb2.STATE_STANDSTILL
        if self.name == "sticky":
            self.end(types_pb2.COMMAND_STATE_ERROR, error_pb2.ErrorDetail(
                reason=error_pb2.REASON_NOT_REACHED, message="the drive stopped 2 mm before the target",
                remedy="look for an obstacle, then reset"))
            self.state.state = types_pb2.STATE_ERROR_STOP
        else:
            self.end(types_pb2.COMMAND_STATE_DONE)

    async def run(self, command, velocity, hold):
        self.machine.change(command, types_pb2.COMMAND_STATE_ACTIVE)
        self.state.state = types_pb2.STATE_CONTINUOUS_MOTION
        self.state.moving, self.state.velocity = True, velocity
        self.hold_until = time.monotonic() + hold if hold else None
        while self.hold_until is None or time.monotonic() < self.hold_until:
            self.state.position += velocity * STEP
            await asyncio.sleep(STEP)
        self.state.state = types_pb2.STATE_STANDSTILL
        self.end(types_pb2.COMMAND_STATE_DONE)


def offline_detail():
    return error_pb2.ErrorDetail(reason=error_pb2.REASON_OFFLINE, message="the drive does not answer",
                                 remedy="check power and wiring; it is retried by itself", bus="line-a", node=9,
                                 outcome=error_pb2.OUTCOME_NOT_SENT)
