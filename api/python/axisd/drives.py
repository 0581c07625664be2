"""Drives, buses and events, as plain immutable values. Each keeps the message that it came from as `raw`."""
from __future__ import annotations

import dataclasses
import datetime
from typing import Any

from google.protobuf.duration_pb2 import Duration

from .configuration import ConfigChange
from .kept_state import Conviction
from .types import (Command, ErrorDetail, Link, MotionCause, State, _member, _optional, _optional_error, _optional_time, seconds)
from .v1 import bus_service_pb2, drive_service_pb2, event_service_pb2, types_pb2


@dataclasses.dataclass(frozen=True)
class TerminalCapability:
    """A terminal of a model, and the functions that it can have."""
    name: str
    functions: tuple[str, ...]


@dataclasses.dataclass(frozen=True)
class Alarm:
    """`reset`: "power_cycle", "by_itself" or "by_command"."""
    code: int
    name: str
    reset: str
    remedy: str


@dataclasses.dataclass(frozen=True)
class DriveInfo:
    """What a drive can do; more is in `raw`."""
    axis: str
    model: str
    version: str
    closed_loop: bool
    maximum_segments: int
    inputs: tuple[TerminalCapability, ...]
    outputs: tuple[TerminalCapability, ...]
    alarms: tuple[Alarm, ...]
    eeprom_writes: int
    raw: drive_service_pb2.GetDriveResponse = dataclasses.field(repr=False, compare=False)

    @classmethod
    def of(cls, raw: drive_service_pb2.GetDriveResponse) -> DriveInfo:
        def terminals(all_of_them: Any) -> tuple[TerminalCapability, ...]:
            return tuple(TerminalCapability(t.name, tuple(t.functions)) for t in all_of_them)
        reset = drive_service_pb2.AlarmReset.Name
        alarms = tuple(Alarm(a.code, a.name, reset(a.reset).removeprefix("ALARM_RESET_").lower(), a.remedy)
                       for a in raw.alarms)
        return cls(raw.axis, raw.model, raw.version, raw.closed_loop, raw.maximum_segments, terminals(raw.inputs),
                   terminals(raw.outputs), alarms, raw.eeprom_writes, raw)


@dataclasses.dataclass(frozen=True)
class Parameter:
    """One parameter of a model. `access`: "read_only", "read_write", "read_write_saved" or "write_only".
    `configured_by`: the key of the configuration that decides it; `instead`: the call that does what writing a trigger
    would do."""
    name: str
    address: int
    minimum: int
    maximum: int
    default: int | None
    unit: str
    access: str
    description: str
    configured_by: str
    instead: str
    raw: drive_service_pb2.Parameter = dataclasses.field(repr=False, compare=False)

    @classmethod
    def of(cls, raw: drive_service_pb2.Parameter) -> Parameter:
        access = drive_service_pb2.ParameterAccess.Name(raw.access).removeprefix("PARAMETER_ACCESS_").lower()
        return cls(raw.name, raw.address, raw.minimum, raw.maximum, _optional(raw, "default_value"), raw.unit, access,
                   raw.description, raw.configured_by, raw.instead, raw)


def _time(value: float) -> Duration:
    message = Duration()
    message.FromTimedelta(datetime.timedelta(seconds=value))
    return message


@dataclasses.dataclass(frozen=True)
class PositionSegment:
    """A row of the drive's table of positions. `acceleration_time` is shared with the velocity of that number."""
    number: int
    target: float
    velocity: float
    acceleration_time: float = 0.1


@dataclasses.dataclass(frozen=True)
class VelocitySegment:
    number: int
    velocity: float
    acceleration_time: float = 0.1


@dataclasses.dataclass(frozen=True)
class Segments:
    """The drive's own table, which its terminals select from. `absolute`: targets are positions, not distances."""
    positions: tuple[PositionSegment, ...] = ()
    velocities: tuple[VelocitySegment, ...] = ()
    absolute: bool = False

    @classmethod
    def of(cls, raw: drive_service_pb2.SegmentTable) -> Segments:
        return cls(tuple(PositionSegment(r.number, r.target, r.velocity, seconds(r.acceleration_time))
                         for r in raw.positions),
                   tuple(VelocitySegment(r.number, r.velocity, seconds(r.acceleration_time)) for r in raw.velocities),
                   raw.absolute)

    def message(self) -> drive_service_pb2.SegmentTable:
        return drive_service_pb2.SegmentTable(
            absolute=self.absolute,
            positions=[drive_service_pb2.PositionSegment(number=r.number, target=r.target, velocity=r.velocity,
                                                         acceleration_time=_time(r.acceleration_time))
                       for r in self.positions],
            velocities=[drive_service_pb2.VelocitySegment(number=r.number, velocity=r.velocity,
                                                          acceleration_time=_time(r.acceleration_time))
                        for r in self.velocities])


@dataclasses.dataclass(frozen=True)
class SerialProgress:
    """How far a change of address or serial settings is: "written" (switch the drive off and on), "waiting" or
    "verified"."""
    phase: str
    text: str

    @classmethod
    def of(cls, raw: Any) -> SerialProgress:
        name = drive_service_pb2.SerialPhase.Name(raw.phase)
        return cls(name.removeprefix("SERIAL_PHASE_").lower(), raw.text)


@dataclasses.dataclass(frozen=True)
class FoundNode:
    """A node that a scan found. `model` is empty if it is no known drive; `configured_as` is empty if nothing in the
    configuration has its address. What follows `note` is of nodes on CAN networks, which have no `format`."""
    node: int
    baud: int
    format: str
    model: str
    version: str
    pulses_per_revolution: int
    configured_as: str
    note: str
    device_type: int | None = None
    vendor: int | None = None
    product: int | None = None
    revision: int | None = None
    serial_number: int | None = None

    @classmethod
    def of(cls, raw: bus_service_pb2.FoundNode) -> FoundNode:
        return cls(raw.node, raw.baud, raw.format, raw.model, raw.version, raw.pulses_per_revolution,
                   raw.configured_as, raw.note, *(_optional(raw, field) for field in (
                       "device_type", "vendor", "product", "revision", "serial_number")))


@dataclasses.dataclass(frozen=True)
class ScanProgress:
    """Probes so far and in all; `found` since the last one."""
    probed: int
    total: int
    found: tuple[FoundNode, ...]

    @classmethod
    def of(cls, raw: bus_service_pb2.ScanResponse) -> ScanProgress:
        return cls(raw.probed, raw.total, tuple(FoundNode.of(node) for node in raw.found))


@dataclasses.dataclass(frozen=True)
class Device:
    """A node that is not an axis, with its registers or objects as last read (None: not read yet)."""
    name: str
    bus: str
    node: int
    link: Link
    error: ErrorDetail | None
    values: dict[str, float | None]
    raw: bus_service_pb2.Device = dataclasses.field(repr=False, compare=False)

    @classmethod
    def of(cls, raw: bus_service_pb2.Device) -> Device:
        return cls(raw.name, raw.bus, raw.node,
                   _member(Link, types_pb2.LinkState.DESCRIPTOR, "LINK_STATE_", raw.link),
                   _optional_error(raw, "error"), {v.name: _optional(v, "value") for v in raw.values}, raw)


@dataclasses.dataclass(frozen=True)
class TerminalEdge:
    """A terminal changed; the edge lies between `after` and `before`."""
    terminal: str
    function: str
    active: bool
    after: datetime.datetime | None
    before: datetime.datetime | None


@dataclasses.dataclass(frozen=True)
class StateChange:
    from_state: State
    to_state: State
    cause: MotionCause


@dataclasses.dataclass(frozen=True)
class LinkChange:
    to: Link
    detail: str


@dataclasses.dataclass(frozen=True)
class ConfigurationDrift:
    """`text` is empty when the drive holds its configuration again."""
    text: str


@dataclasses.dataclass(frozen=True)
class FlightRecordWritten:
    """The newest frames of a bus were written to a file: Machine.flight_record()."""
    bus: str
    name: str
    reason: str


@dataclasses.dataclass(frozen=True)
class LeaseChange:
    """Who may command the axis from now on, and until now; empty: nobody. `kind`: "acquired", "released", "expired" or
    "taken"."""
    kind: str
    holder: str
    before: str


@dataclasses.dataclass(frozen=True)
class ConfigurationReloaded:
    """Another configuration is served from now on. No `changes`: only how it is written has changed."""
    client: str
    previous_revision: str
    revision: str
    changes: tuple[ConfigChange, ...]


@dataclasses.dataclass(frozen=True)
class StopHoldChange:
    """Somebody began or ceased to hold an axis in Stopping. `kind`: "held", "released" or "not_durable"; `by`: who
    released it, or holds it."""
    kind: str
    holder: str
    request_id: str
    by: str


@dataclasses.dataclass(frozen=True)
class CommandChange:
    """A command was accepted, or has ended: as it stood then."""
    command: Command


@dataclasses.dataclass(frozen=True)
class AxisFault:
    """An axis went into ErrorStop, or another cause took the place of the first."""
    cause: ErrorDetail


@dataclasses.dataclass(frozen=True)
class KeptStateChange:
    """Files of the state convict each other, so that motion waits; or somebody has accepted that (`accepted_by`)."""
    convictions: tuple[Conviction, ...]
    accepted_by: str


@dataclasses.dataclass(frozen=True)
class InhibitChange:
    """StopAll inhibits motion of the whole machine, or was released. `kind`: "latched", "released", "stands" (at the
    start of the daemon) or "not_durable"; `by`: who called StopAll, or released it."""
    kind: str
    by: str


@dataclasses.dataclass(frozen=True)
class CertificateNotice:
    """The certificates of the daemon end soon, have ended, or were read again. `kind`: "expires_soon", "expired",
    "replaced" or "not_replaced"; `path`: the file, empty: all of them; `text`: one line, with what to do."""
    kind: str
    path: str
    expires: datetime.datetime | None
    text: str


@dataclasses.dataclass(frozen=True)
class EepromWritten:
    """Registers were saved to the EEPROM of the axis's drive: since the last such event, and since the axis is known there."""
    registers: int
    total: int


Content = (TerminalEdge | StateChange | LinkChange | ConfigurationDrift | FlightRecordWritten | LeaseChange
           | ConfigurationReloaded | StopHoldChange | CommandChange | AxisFault | KeptStateChange
           | InhibitChange | CertificateNotice | EepromWritten)


def _content(raw: event_service_pb2.Event) -> Content | None:
    kind = raw.WhichOneof("content")
    content = getattr(raw, kind) if kind else None
    if kind == "terminal_edge":
        return TerminalEdge(content.terminal, content.function, content.active, _optional_time(content, "after"),
                            _optional_time(content, "before"))
    if kind == "state_change":
        states = types_pb2.State.DESCRIPTOR
        return StateChange(_member(State, states, "STATE_", getattr(content, "from")),
                           _member(State, states, "STATE_", content.to),
                           _member(MotionCause, types_pb2.MotionCause.DESCRIPTOR, "MOTION_CAUSE_", content.cause))
    if kind == "link_change":
        return LinkChange(_member(Link, types_pb2.LinkState.DESCRIPTOR, "LINK_STATE_", content.to), content.detail)
    if kind == "configuration_drift":
        return ConfigurationDrift(content.text)
    if kind == "flight_record":
        return FlightRecordWritten(content.bus, content.name, content.reason)
    if kind == "lease_change":
        name = event_service_pb2.LeaseChangeKind.Name(content.kind)
        return LeaseChange(name.removeprefix("LEASE_CHANGE_KIND_").lower(), content.holder, content.before)
    if kind == "configuration_reloaded":
        return ConfigurationReloaded(content.client, content.previous_revision, content.revision,
                                     tuple(ConfigChange.of(change) for change in content.changes))
    if kind == "command_change":
        return CommandChange(Command.of(content.command))
    if kind == "axis_fault":
        return AxisFault(ErrorDetail.of(content.cause))
    if kind == "kept_state_change":
        return KeptStateChange(tuple(Conviction.of(each) for each in content.convictions), content.accepted_by)
    if kind == "inhibit_change":
        name = event_service_pb2.InhibitChangeKind.Name(content.kind)
        return InhibitChange(name.removeprefix("INHIBIT_CHANGE_KIND_").lower(), content.by)
    if kind == "certificate_notice":
        name = event_service_pb2.CertificateNoticeKind.Name(content.kind)
        return CertificateNotice(name.removeprefix("CERTIFICATE_NOTICE_KIND_").lower(), content.path,
                                 _optional_time(content, "expires"), content.text)
    if kind == "eeprom_written":
        return EepromWritten(content.registers, content.total)
    if kind == "stop_hold_change":
        name = event_service_pb2.StopHoldChangeKind.Name(content.kind)
        return StopHoldChange(name.removeprefix("STOP_HOLD_CHANGE_KIND_").lower(), content.holder, content.request_id,
                              content.by)
    return None


@dataclasses.dataclass(frozen=True)
class Cursor:
    """Where to go on with Machine.events(), also after a lost connection."""
    instance_id: str
    sequence: int


@dataclasses.dataclass(frozen=True)
class Event:
    """`content` is None for a kind that this package does not know. `lost`: events before this one that are no longer
    kept."""
    sequence: int
    at: datetime.datetime | None
    axis: str
    content: Content | None
    cursor: Cursor
    lost: int
    raw: event_service_pb2.Event = dataclasses.field(repr=False, compare=False)

    @classmethod
    def of(cls, raw: event_service_pb2.Event, instance_id: str, lost: int) -> Event:
        return cls(raw.sequence, _optional_time(raw, "at"), raw.axis, _content(raw), Cursor(instance_id, raw.sequence),
                   lost, raw)
