"""What the daemon tells, as plain immutable values. Positions in the axis's unit, velocities per second, times in
seconds. Each value keeps the message that it came from as `raw`."""
from __future__ import annotations

import dataclasses
import datetime
import enum
import re
from typing import Any

from google.protobuf.duration_pb2 import Duration
from google.protobuf.timestamp_pb2 import Timestamp

from .holds import StopHold
from .reasons import Outcome, Reason
from .v1 import access_pb2, axis_service_pb2, bus_service_pb2, error_pb2, group_service_pb2, system_service_pb2, types_pb2


class State(enum.Enum):
    """PLCopen states of an axis. Whether the drive can be reached is Link."""
    UNSPECIFIED = "Unspecified"
    DISABLED = "Disabled"
    STANDSTILL = "Standstill"
    HOMING = "Homing"
    DISCRETE_MOTION = "DiscreteMotion"
    CONTINUOUS_MOTION = "ContinuousMotion"
    SYNCHRONIZED_MOTION = "SynchronizedMotion"
    STOPPING = "Stopping"
    ERROR_STOP = "ErrorStop"


class Link(enum.Enum):
    UNSPECIFIED = "Unspecified"
    OFFLINE = "Offline"
    CONFIGURING = "Configuring"
    ONLINE = "Online"


class Trust(enum.Enum):
    """How far the position can be believed."""
    UNSPECIFIED = "Unspecified"
    UNKNOWN = "Unknown"
    SET = "Set"
    HOMED = "Homed"
    RESTORED = "Restored"


class MotionCause(enum.Enum):
    """Who set an axis in motion."""
    UNSPECIFIED = "Unspecified"
    NONE = "None"
    COMMAND = "Command"
    TERMINAL = "Terminal"
    UNKNOWN = "Unknown"


class CommandState(enum.Enum):
    UNSPECIFIED = "Unspecified"
    ACCEPTED = "Accepted"
    ACTIVE = "Active"
    DONE = "Done"
    ABORTED = "Aborted"
    ERROR = "Error"
    UNKNOWN = "Unknown"

    @property
    def ended(self) -> bool:
        return self in (CommandState.DONE, CommandState.ABORTED, CommandState.ERROR, CommandState.UNKNOWN)


def _member(kind: Any, descriptor: Any, prefix: str, number: int) -> Any:
    """The enum member for a number; a newer daemon's unknown numbers are UNSPECIFIED."""
    value = descriptor.values_by_number.get(number)
    name = value.name.removeprefix(prefix) if value is not None else "UNSPECIFIED"
    return kind[name] if name in kind.__members__ else kind["UNSPECIFIED"]


def seconds(duration: Duration) -> float:
    return (duration.seconds * 1_000_000_000 + duration.nanos) / 1e9


def _optional(message: Any, field: str) -> Any:
    return getattr(message, field) if message.HasField(field) else None


def _optional_seconds(message: Any, field: str) -> float | None:
    return seconds(getattr(message, field)) if message.HasField(field) else None


def _optional_time(message: Any, field: str) -> datetime.datetime | None:
    if not message.HasField(field):
        return None
    stamp: Timestamp = getattr(message, field)
    return stamp.ToDatetime(tzinfo=datetime.timezone.utc)


@dataclasses.dataclass(frozen=True)
class PermittedRange:
    minimum: float
    maximum: float
    unit: str

    def __str__(self) -> str:
        return f"{self.minimum:g} to {self.maximum:g} {self.unit}".rstrip()


def in_cell(remedy: str, machine: str, axis: str) -> str:
    """A machine's advice for whoever asks through the entrance of its cell: "axisctl reset feeder" is
    "axisctl reset press-2/feeder" there, and "axisctl state" is "axisctl --machine press-2 state"."""
    def named(command: re.Match[str]) -> str:
        verb, words = command[1], command[2]
        # An axis may be called as a command is.
        full = re.sub(rf"(?<=\s){re.escape(axis)}(?![\w/-])", f"{machine}/{axis}", words) if axis else words
        return f"axisctl {verb}{full}" if full != words else f"axisctl --machine {machine} {verb}{words}"

    return re.sub(r"axisctl (?!machines\b)([a-z-]*[a-z])((?: [^,;:'()]*)?)", named, remedy)


@dataclasses.dataclass(frozen=True)
class ErrorDetail:
    """What happened, where, and what to do."""
    reason: Reason
    message: str
    remedy: str
    outcome: Outcome
    bus: str
    node: int | None
    object: int | None
    native_code: int | None
    permitted: PermittedRange | None
    raw: error_pb2.ErrorDetail = dataclasses.field(repr=False, compare=False)

    @classmethod
    def of(cls, raw: error_pb2.ErrorDetail) -> ErrorDetail:
        permitted = raw.permitted
        return cls(
            _member(Reason, error_pb2.Reason.DESCRIPTOR, "REASON_", raw.reason), raw.message, raw.remedy,
            _member(Outcome, error_pb2.Outcome.DESCRIPTOR, "OUTCOME_", raw.outcome), raw.bus,
            _optional(raw, "node"), _optional(raw, "object"), _optional(raw, "native_code"),
            PermittedRange(permitted.minimum, permitted.maximum, permitted.unit) if raw.HasField("permitted") else None,
            raw)

    def of_member(self, machine: str, axis: str) -> ErrorDetail:
        """As what a machine of a cell says of this axis."""
        return dataclasses.replace(self, remedy=in_cell(self.remedy, machine, axis))

    def __str__(self) -> str:
        text = self.message or self.reason.replace("_", " ")
        if self.permitted is not None and "permitted" not in text:
            text += f" (permitted {self.permitted})"
        return f"{text}; {self.remedy}" if self.remedy else text


@dataclasses.dataclass(frozen=True)
class Obstacle:
    """Something that stands in the way of a command, with what to do about it. Not `blocking`: the command is not refused
    for it, but would wait for it, end it, or may be ended by it."""
    blocking: bool
    reason: Reason
    message: str
    remedy: str
    permitted: PermittedRange | None
    raw: system_service_pb2.Obstacle = dataclasses.field(repr=False, compare=False)

    @classmethod
    def of(cls, raw: system_service_pb2.Obstacle) -> Obstacle:
        detail = ErrorDetail.of(raw.detail)
        return cls(raw.blocking, detail.reason, detail.message, detail.remedy, detail.permitted, raw)

    def __str__(self) -> str:
        return str(ErrorDetail.of(self.raw.detail))


def _optional_error(message: Any, field: str) -> ErrorDetail | None:
    return ErrorDetail.of(getattr(message, field)) if message.HasField(field) else None


@dataclasses.dataclass(frozen=True)
class Terminal:
    """A digital input or output; `active` has the configured active level applied."""
    name: str
    function: str
    active: bool


@dataclasses.dataclass(frozen=True)
class AxisState:
    """Everything known about an axis at one moment; see proto/axisd/v1/types.proto for each field."""
    axis: str
    unit: str
    state: State
    link: Link
    link_error: ErrorDetail | None
    fault: ErrorDetail | None
    enabled: bool
    enabled_by_daemon: bool
    stop_held: bool
    inhibited: bool
    position: float
    velocity: float
    target: float | None
    moving: bool
    in_position: bool
    trust: Trust
    alarm_code: int
    alarm_name: str
    inputs: tuple[Terminal, ...]
    outputs: tuple[Terminal, ...]
    measured_at: datetime.datetime | None
    age: float | None
    simulated: bool
    command_id: str
    model: str
    bus: str
    node: int
    motion_cause: MotionCause
    drift: str
    eeprom_writes: int
    link_note: str
    lease_holder: str
    start_note: str
    starts_by_sync: bool
    commanded_position: float | None
    following_error: float | None
    holds: tuple[StopHold, ...]
    raw: types_pb2.AxisState = dataclasses.field(repr=False, compare=False)

    @classmethod
    def of(cls, raw: types_pb2.AxisState) -> AxisState:
        return cls(
            axis=raw.axis, unit=raw.unit, state=_member(State, types_pb2.State.DESCRIPTOR, "STATE_", raw.state),
            link=_member(Link, types_pb2.LinkState.DESCRIPTOR, "LINK_STATE_", raw.link),
            link_error=_optional_error(raw, "link_error"), fault=_optional_error(raw, "fault"), enabled=raw.enabled,
            enabled_by_daemon=raw.enabled_by_daemon, stop_held=raw.stop_held, inhibited=raw.inhibited,
            position=raw.position, velocity=raw.velocity, target=_optional(raw, "target"), moving=raw.moving,
            in_position=raw.in_position,
            trust=_member(Trust, types_pb2.PositionTrust.DESCRIPTOR, "POSITION_TRUST_", raw.trust),
            alarm_code=raw.alarm_code, alarm_name=raw.alarm_name,
            inputs=tuple(Terminal(t.name, t.function, t.active) for t in raw.inputs),
            outputs=tuple(Terminal(t.name, t.function, t.active) for t in raw.outputs),
            measured_at=_optional_time(raw, "measured_at"), age=_optional_seconds(raw, "age"),
            simulated=raw.simulated, command_id=raw.command_id, model=raw.model, bus=raw.bus, node=raw.node,
            motion_cause=_member(MotionCause, types_pb2.MotionCause.DESCRIPTOR, "MOTION_CAUSE_", raw.motion_cause),
            drift=raw.drift, eeprom_writes=raw.eeprom_writes, link_note=raw.link_note,
            lease_holder=raw.lease_holder, start_note=raw.start_note,
            starts_by_sync=raw.starts_by_sync, commanded_position=_optional(raw, "commanded_position"),
            following_error=_optional(raw, "following_error"),
            holds=tuple(StopHold.of(hold) for hold in raw.holds), raw=raw)


@dataclasses.dataclass(frozen=True)
class MotionValues:
    """Values of a motion; None where one does not apply."""
    position: float | None
    distance: float | None
    velocity: float | None
    search_velocity: float | None
    acceleration_time: float | None
    deceleration_time: float | None
    hold: float | None

    @classmethod
    def of(cls, raw: types_pb2.MotionValues) -> MotionValues:
        return cls(_optional(raw, "position"), _optional(raw, "distance"), _optional(raw, "velocity"),
                   _optional(raw, "search_velocity"), _optional_seconds(raw, "acceleration_time"),
                   _optional_seconds(raw, "deceleration_time"), _optional_seconds(raw, "hold"))


@dataclasses.dataclass(frozen=True)
class Command:
    """One accepted motion request. `granted` is what the drive's resolution made of `asked`."""
    id: str
    axis: str
    kind: str
    state: CommandState
    asked: MotionValues
    granted: MotionValues
    cause: ErrorDetail | None
    request_id: str
    client: str
    accepted_at: datetime.datetime | None
    started_at: datetime.datetime | None
    ended_at: datetime.datetime | None
    raw: types_pb2.Command = dataclasses.field(repr=False, compare=False)

    @classmethod
    def of(cls, raw: types_pb2.Command) -> Command:
        kind = types_pb2.CommandKind.DESCRIPTOR.values_by_number.get(raw.kind)
        return cls(
            raw.id, raw.axis, kind.name.removeprefix("COMMAND_KIND_").lower() if kind else str(raw.kind),
            _member(CommandState, types_pb2.CommandState.DESCRIPTOR, "COMMAND_STATE_", raw.state),
            MotionValues.of(raw.asked), MotionValues.of(raw.granted), _optional_error(raw, "cause"), raw.request_id,
            raw.client, _optional_time(raw, "accepted_at"), _optional_time(raw, "started_at"), _optional_time(raw, "ended_at"),
            raw)


@dataclasses.dataclass(frozen=True)
class Tick:
    """One batch of a watch. `dropped` counts the ticks that this reader was too slow for."""
    instance_id: str
    tick: int
    dropped: int
    axes: dict[str, AxisState]

    @classmethod
    def of(cls, raw: axis_service_pb2.WatchAxesResponse) -> Tick:
        return cls(raw.instance_id, raw.tick, raw.dropped, {state.axis: AxisState.of(state) for state in raw.axes})


class Role(enum.Enum):
    """What a client may do, each including those before it."""
    UNSPECIFIED = "unspecified"
    NONE = "none"
    """To stop, and nothing else."""
    VIEWER = "viewer"
    """To read."""
    OPERATOR = "operator"
    """To move."""
    MAINTAINER = "maintainer"
    """To change drives and configuration, and to release what others hold."""


def _role(number: int) -> Role:
    return _member(Role, access_pb2.Role.DESCRIPTOR, "ROLE_", number)


@dataclasses.dataclass(frozen=True)
class Info:
    machine: str
    version: str
    instance_id: str
    inhibited: bool
    inhibited_by: str
    state_unaccepted: str = ""
    """Why motion waits until Machine.accept_state(); empty: it does not."""
    client: str = ""
    """Who is asking: the client of its commands, holds and leases."""
    identity: str = ""
    """The name by which `access:` of the configuration knows the client."""
    role: Role = Role.UNSPECIFIED
    """What the client may do on the machine, and on each axis that is not in `axis_roles`."""
    axis_roles: dict[str, Role] = dataclasses.field(default_factory=dict)
    storage_error: ErrorDetail | None = None
    """Why nothing new is started: the daemon cannot write to its disk. Stops are executed."""

    @classmethod
    def of(cls, raw: system_service_pb2.GetInfoResponse) -> Info:
        return cls(raw.machine, raw.version, raw.instance_id, raw.inhibited, raw.inhibited_by,
                   raw.state_unaccepted, raw.client, raw.identity, _role(raw.role),
                   {each.axis: _role(each.role) for each in raw.axis_roles}, _optional_error(raw, "storage_error"))


@dataclasses.dataclass(frozen=True)
class StopResult:
    """What a stop of several axes did to one of them: a command or an error."""
    axis: str
    """Of a group's stop also a name that there is not."""
    command: Command | None
    error: ErrorDetail | None

    @classmethod
    def of(cls, raw: system_service_pb2.StopResult | group_service_pb2.GroupStopResult) -> StopResult:
        name = raw.name if isinstance(raw, group_service_pb2.GroupStopResult) else raw.axis
        return cls(name, Command.of(raw.command) if raw.HasField("command") else None,
                   _optional_error(raw, "error"))

    @property
    def confirmed(self) -> bool:
        """It stands still, as the daemon has seen."""
        return self.command is not None and self.command.state is CommandState.DONE

    def __str__(self) -> str:
        cause = self.error if self.command is None else self.command.cause
        text = str(cause).removeprefix(f"{self.axis}: ") if cause is not None else ""
        if self.command is not None:
            text = f"{self.command.kind} {self.command.state.value}{': ' if text else ''}{text}"
        return f"{self.axis}: {text}"


class BusKind(enum.Enum):
    UNSPECIFIED = "Unspecified"
    MODBUS_RTU = "ModbusRtu"
    CANOPEN = "Canopen"


class NetworkLink(enum.Enum):
    """State of a CAN network's link; BUS_OFF and STALLED need it to go down and up."""
    UNSPECIFIED = "Unspecified"
    REMOVED = "Removed"
    DOWN = "Down"
    UP = "Up"
    ERROR_PASSIVE = "ErrorPassive"
    BUS_OFF = "BusOff"
    STALLED = "Stalled"


@dataclasses.dataclass(frozen=True)
class Network:
    """What is known of a CAN network (all counters are in `raw`). `foreign_nodes` are heard, but not configured;
    `link_helper_error` says why nobody takes the link down and up after bus-off or a stall."""
    link: NetworkLink
    frames_sent: int
    frames_received: int
    sdo_transfers: int
    sdo_aborts: int
    sdo_timeouts: int
    sync_running: bool
    sync_sent: int
    sync_missed: int
    emergencies: int
    foreign_nodes: tuple[int, ...]
    link_helper_error: ErrorDetail | None
    raw: bus_service_pb2.NetworkStatus = dataclasses.field(repr=False, compare=False)

    @classmethod
    def of(cls, raw: bus_service_pb2.NetworkStatus) -> Network:
        return cls(_member(NetworkLink, bus_service_pb2.NetworkLink.DESCRIPTOR, "NETWORK_LINK_", raw.link),
                   raw.frames_sent, raw.frames_received, raw.sdo_transfers, raw.sdo_aborts, raw.sdo_timeouts,
                   raw.sync_running, raw.sync_sent, raw.sync_missed, raw.emergencies, tuple(raw.foreign_nodes),
                   _optional_error(raw, "link_helper_error"), raw)


@dataclasses.dataclass(frozen=True)
class Bus:
    """One bus. `port` is a serial device or a network interface, `baud` also the bit rate of a network; `transactions`
    and `timeouts` are those of a line (all counters are in `raw`), `network` is None for one."""
    name: str
    kind: BusKind
    port: str
    baud: int
    open: bool
    error: ErrorDetail | None
    simulated: bool
    transactions: int
    timeouts: int
    network: Network | None
    raw: bus_service_pb2.Bus = dataclasses.field(repr=False, compare=False)

    @classmethod
    def of(cls, raw: bus_service_pb2.Bus) -> Bus:
        return cls(raw.name, _member(BusKind, bus_service_pb2.BusKind.DESCRIPTOR, "BUS_KIND_", raw.kind), raw.port,
                   raw.baud, raw.open, _optional_error(raw, "error"), raw.simulated, raw.transactions, raw.timeouts,
                   Network.of(raw.network) if raw.HasField("network") else None, raw)
