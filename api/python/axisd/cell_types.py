"""What an entrance tells of its cell, as plain immutable values. Each keeps the message that it came from as `raw`."""
from __future__ import annotations

import dataclasses
import datetime
import enum

from .cell.v1 import cell_service_pb2 as cell_pb
from .drives import Cursor
from .kept_state import AllStopped
from .types import ErrorDetail, _member, _optional_error, _optional_seconds, _optional_time, seconds


class MachineState(enum.Enum):
    UNSPECIFIED = "Unspecified"
    PRESENT = "Present"
    """Registered, or named in the entrance's configuration, and its axisd answers."""
    SILENT = "Silent"
    """The same, and its axisd does not answer."""
    UNREGISTERED = "Unregistered"
    """Its axisd answers, but it is not registered."""
    GONE = "Gone"
    """Neither."""

    @property
    def answers(self) -> bool:
        return self in (MachineState.PRESENT, MachineState.UNREGISTERED)


class Registry(enum.Enum):
    """How the cell's registry is."""
    UNSPECIFIED = "Unspecified"
    BY_HAND = "ByHand"
    """There is none: machines are those that the entrance's configuration names."""
    OK = "Ok"
    DEGRADED = "Degraded"
    """What was known last is gone on with; forwarding and stops need no registry."""


class MachineOutcome(enum.Enum):
    """What became of a StopAll, or its release, at a machine."""
    UNSPECIFIED = "Unspecified"
    DONE = "Done"
    SILENT = "Silent"
    """It did not answer in time. A StopAll is told again when it comes back, a release is not."""
    FAILED = "Failed"


def _outcome(number: int) -> MachineOutcome:
    outcome: MachineOutcome = _member(MachineOutcome, cell_pb.MachineOutcome.DESCRIPTOR, "MACHINE_OUTCOME_", number)
    return outcome


def _machine_state(number: int) -> MachineState:
    state: MachineState = _member(MachineState, cell_pb.MachineState.DESCRIPTOR, "MACHINE_STATE_", number)
    return state


def _registry(number: int) -> Registry:
    registry: Registry = _member(Registry, cell_pb.RegistryState.DESCRIPTOR, "REGISTRY_STATE_", number)
    return registry


@dataclasses.dataclass(frozen=True)
class CellMachine:
    """A machine, as the entrance sees it. `axes`: their names as Cell.axis() takes them; None: not known, as without etcd
    (Machine.axes() asks it). `round_trip`: of the last question that was answered (s). `stop_all`: its own StopAll holds it. `trouble`: why it does not answer, or is not taken for
    this machine. `own`: it is the entrance's."""
    name: str
    state: MachineState
    since: datetime.datetime | None
    axes: tuple[str, ...] | None
    version: str
    configuration_revision: str
    round_trip: float | None
    stop_all: bool
    trouble: str
    own: bool
    raw: cell_pb.Machine = dataclasses.field(repr=False, compare=False)

    @classmethod
    def of(cls, raw: cell_pb.Machine) -> CellMachine:
        known = raw.axes or raw.configuration_revision
        return cls(raw.name, _machine_state(raw.state), _optional_time(raw, "since"),
                   tuple(f"{raw.name}/{axis}" for axis in raw.axes) if known else None, raw.version,
                   raw.configuration_revision,
                   _optional_seconds(raw, "round_trip"), raw.stop_all, raw.trouble, raw.own, raw)


@dataclasses.dataclass(frozen=True)
class StopAllLatch:
    """One StopAll of the cell. It stands until it is released."""
    id: str
    by: str
    reason: str
    at: datetime.datetime | None
    entrance: str
    released_by: str

    @classmethod
    def of(cls, raw: cell_pb.StopAllLatch) -> StopAllLatch:
        return cls(raw.id, raw.by, raw.reason, _optional_time(raw, "at"), raw.entrance, raw.released_by)


@dataclasses.dataclass(frozen=True)
class CellInfo:
    """The cell, and the entrance that was asked: of which machine, in which version. `client`: who machines are told is
    asking. `stop_all`: those that stand."""
    cell: str
    machine: str
    version: str
    registry: Registry
    registry_since: datetime.datetime | None
    registry_trouble: ErrorDetail | None
    stop_all: tuple[StopAllLatch, ...]
    client: str
    raw: cell_pb.GetCellResponse = dataclasses.field(repr=False, compare=False)

    @classmethod
    def of(cls, raw: cell_pb.GetCellResponse) -> CellInfo:
        return cls(raw.cell, raw.machine, raw.version, _registry(raw.registry), _optional_time(raw, "registry_since"),
                   _optional_error(raw, "registry_trouble"), tuple(StopAllLatch.of(latch) for latch in raw.stop_all),
                   raw.client, raw)


@dataclasses.dataclass(frozen=True)
class MachineStop:
    """What became of a StopAll at a machine. `axes`: its answer, axis by axis. `took`: until it answered (s)."""
    machine: str
    outcome: MachineOutcome
    error: ErrorDetail | None
    took: float
    axes: AllStopped

    @classmethod
    def of(cls, raw: cell_pb.MachineStop) -> MachineStop:
        return cls(raw.machine, _outcome(raw.outcome), _optional_error(raw, "error"), seconds(raw.took),
                   AllStopped.of(raw.response))

    def __str__(self) -> str:
        return f"{self.machine}: {self.error or self.outcome.value}"


@dataclasses.dataclass(frozen=True)
class CellStopped:
    """A StopAll of the cell. Look at `failed`: those machines did not confirm it. `not_durable`, `not_shared`: why the latch
    is not on the entrance's disk, or not known to entrances that this one cannot reach; None: it is."""
    machines: tuple[MachineStop, ...]
    latch: StopAllLatch
    not_durable: ErrorDetail | None
    not_shared: ErrorDetail | None

    @classmethod
    def of(cls, raw: cell_pb.StopAllResponse) -> CellStopped:
        return cls(tuple(MachineStop.of(machine) for machine in raw.machines), StopAllLatch.of(raw.latch),
                   _optional_error(raw, "not_durable"), _optional_error(raw, "not_shared"))

    @property
    def failed(self) -> dict[str, MachineStop]:
        """By name; none: all machines that are known are latched."""
        return {stop.machine: stop for stop in self.machines if stop.outcome is not MachineOutcome.DONE}


@dataclasses.dataclass(frozen=True)
class MachineRelease:
    """What became of a release at a machine; one that is not DONE stays latched."""
    machine: str
    outcome: MachineOutcome
    error: ErrorDetail | None

    @classmethod
    def of(cls, raw: cell_pb.MachineRelease) -> MachineRelease:
        return cls(raw.machine, _outcome(raw.outcome), _optional_error(raw, "error"))


@dataclasses.dataclass(frozen=True)
class CellReleased:
    """The release of a cell. Look at `failed`: those machines stay latched, and cell.machine(NAME).release_stop_all()
    releases them."""
    machines: tuple[MachineRelease, ...]
    released: tuple[StopAllLatch, ...]
    not_durable: ErrorDetail | None
    not_shared: ErrorDetail | None

    @classmethod
    def of(cls, raw: cell_pb.ReleaseStopAllResponse) -> CellReleased:
        return cls(tuple(MachineRelease.of(machine) for machine in raw.machines),
                   tuple(StopAllLatch.of(latch) for latch in raw.released), _optional_error(raw, "not_durable"),
                   _optional_error(raw, "not_shared"))

    @property
    def failed(self) -> dict[str, MachineRelease]:
        return {release.machine: release for release in self.machines if release.outcome is not MachineOutcome.DONE}


@dataclasses.dataclass(frozen=True)
class CellEvent:
    """What the entrance saw. `kind`: "machine", "registry", "stop_all", "stop_all_released", "stop_all_told", "conflict",
    "certificate" or "group_move", of which `raw.group_move` has the step.
    `machine`: empty: it is about the cell. `before` and `state`: of a machine. `lost`: events before this one that are no
    longer kept."""
    sequence: int
    at: datetime.datetime | None
    kind: str
    machine: str
    before: MachineState
    state: MachineState
    registry: Registry
    text: str
    cursor: Cursor
    lost: int
    raw: cell_pb.CellEvent = dataclasses.field(repr=False, compare=False)

    @classmethod
    def of(cls, raw: cell_pb.CellEvent, instance_id: str, lost: int) -> CellEvent:
        known = cell_pb.CellEventKind.DESCRIPTOR.values_by_number.get(raw.kind)
        kind = known.name.removeprefix("CELL_EVENT_KIND_").lower() if known else str(raw.kind)
        return cls(raw.sequence, _optional_time(raw, "at"), kind, raw.machine,
                   _machine_state(getattr(raw, "from")), _machine_state(raw.to), _registry(raw.registry), raw.text,
                   Cursor(instance_id, raw.sequence), lost, raw)
