"""What the daemon remembers over restarts, and whether that is certain."""
from __future__ import annotations

import dataclasses
import datetime

from .types import ErrorDetail, StopResult, _optional_error, _optional_time
from .v1 import system_service_pb2, types_pb2


@dataclasses.dataclass(frozen=True)
class Conviction:
    """A file of the state directory that the others convict. `fault`: "missing", "rolled_back", "damaged", "not_regular",
    "swapped" or "foreign". `found` and `expected`: generations, of the journal numbers of lines; 0: none, or not known. `text`: all of it, for people."""
    file: str
    fault: str
    found: int
    expected: int
    text: str
    since: datetime.datetime | None

    @classmethod
    def of(cls, raw: types_pb2.StateConviction) -> Conviction:
        known = types_pb2.StateFault.DESCRIPTOR.values_by_number.get(raw.fault)
        return cls(raw.file, known.name.removeprefix("STATE_FAULT_").lower() if known else str(raw.fault), raw.found,
                   raw.expected, raw.text, _optional_time(raw, "since"))

    def __str__(self) -> str:
        return self.text


@dataclasses.dataclass(frozen=True)
class KeptFile:
    """The generation that a start of the daemon found of a file, and that the other one knows of, at least."""
    name: str
    generation: int
    expected: int


@dataclasses.dataclass(frozen=True)
class KeptState:
    """Motion waits while there are convictions: look at the machine, then Machine.accept_state()."""
    files: tuple[KeptFile, ...]
    convictions: tuple[Conviction, ...]
    start_count: int

    @classmethod
    def of(cls, raw: system_service_pb2.GetStateResponse) -> KeptState:
        return cls(tuple(KeptFile(file.name, file.generation, file.expected) for file in raw.files),
                   tuple(Conviction.of(conviction) for conviction in raw.convictions), raw.start_count)

    @property
    def accepted(self) -> bool:
        return not self.convictions


class AllStopped(list[StopResult]):
    """What a stop of all axes did to each of them. `not_durable`: why the refusal of motion would not outlive a restart of
    the daemon; None: it is on the disk."""

    not_durable: ErrorDetail | None = None

    @classmethod
    def of(cls, raw: system_service_pb2.StopAllResponse) -> AllStopped:
        stopped = cls(StopResult.of(result) for result in raw.results)
        stopped.not_durable = _optional_error(raw, "not_durable")
        return stopped
