"""Held stops: who holds an axis, and by which names this program has to release its own."""
from __future__ import annotations

import dataclasses
import datetime
import uuid

from .v1 import types_pb2

# More on one axis share the last name; the daemon keeps 16 of a client apart.
_MOST = 8


@dataclasses.dataclass(frozen=True)
class StopHold:
    """Somebody who keeps an axis in Stopping until release_stop(). `durable`: it outlives a restart of the daemon."""
    holder: str
    request_id: str
    since: datetime.datetime
    durable: bool

    @classmethod
    def of(cls, raw: types_pb2.StopHold) -> StopHold:
        return cls(raw.holder, raw.request_id, raw.since.ToDatetime(datetime.timezone.utc), raw.durable)


class Holds:
    """Of one connection, by axis (or by what a group is called)."""

    def __init__(self) -> None:
        self._names: dict[str, list[str]] = {}

    def fresh(self, subject: str, request_id: str | None) -> str:
        """The request_id of a stop that is held from now on: another one each time, so that a late release never ends a
        newer stop."""
        names = self._names.get(subject, [])
        return request_id or (names[-1] if len(names) >= _MOST else str(uuid.uuid4()))

    def add(self, subject: str, request_id: str) -> None:
        names = self._names.setdefault(subject, [])
        if request_id not in names:
            names.append(request_id)

    def drop(self, subject: str, request_id: str) -> None:
        names = self._names.get(subject, [])
        if request_id in names:
            names.remove(request_id)

    def of(self, subject: str) -> list[str]:
        return list(self._names.get(subject, []))
