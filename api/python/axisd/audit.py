"""Who asked the machine for what, and what became of it."""
from __future__ import annotations

import dataclasses
import datetime

from .types import Command, ErrorDetail, _optional_error, _optional_time
from .v1 import audit_service_pb2


@dataclasses.dataclass(frozen=True)
class AuditRecord:
    """`kind`: "command", "refusal", "call", "fault", "lease", "stop_hold", "inhibit", "configuration", "state", "daemon",
    "gap" or "eeprom". `command`: of a command that was accepted, has ended or was refused (then without an id). `recovered`: the
    command journal told of it after the daemon was killed. `error`: why it was refused, or failed. `peer`, `role`: where the
    client called from, and what it might do there; empty: not known. `axis`, `group`, `bus`: what it concerns; all empty: the
    machine. The rest is in `raw`."""
    number: int
    at: datetime.datetime | None
    kind: str
    client: str
    peer: str
    role: str
    axis: str
    group: str
    bus: str
    rpc: str
    request_id: str
    command: Command | None
    recovered: bool
    error: ErrorDetail | None
    raw: audit_service_pb2.AuditRecord = dataclasses.field(repr=False, compare=False)

    @classmethod
    def of(cls, raw: audit_service_pb2.AuditRecord) -> AuditRecord:
        known = audit_service_pb2.AuditKind.DESCRIPTOR.values_by_number.get(raw.kind)
        content = raw.WhichOneof("content")
        command = None
        if content == "recovered":
            command = Command.of(raw.recovered.command)
        elif content == "refused":
            command = Command.of(raw.refused.command)
        elif content == "event" and raw.event.HasField("command_change"):
            command = Command.of(raw.event.command_change.command)
        error = command.cause if command else None
        if content in ("call", "denied"):
            error = _optional_error(getattr(raw, content), "error")
        if content == "event" and raw.event.HasField("axis_fault"):
            error = _optional_error(raw.event.axis_fault, "cause")
        return cls(raw.number, _optional_time(raw, "at"),
                   known.name.removeprefix("AUDIT_KIND_").lower() if known else str(raw.kind), raw.client, raw.peer,
                   raw.role, raw.axis, raw.group, raw.bus, raw.rpc, raw.request_id, command, content == "recovered", error,
                   raw)
