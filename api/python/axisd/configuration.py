"""What the daemon serves, what it says of another configuration, and what became of a reload."""
from __future__ import annotations

import dataclasses
import datetime

from .types import ErrorDetail
from .v1 import system_service_pb2, types_pb2


@dataclasses.dataclass(frozen=True)
class Configuration:
    """What is served: the daemon's file as it was at its start or at the last reload. Equal texts have equal revisions.
    `file_revision`: of what the file holds now; empty if it cannot be read."""
    yaml: str
    path: str
    revision: str
    served_since: datetime.datetime
    file_revision: str

    @classmethod
    def of(cls, raw: system_service_pb2.GetConfigResponse) -> Configuration:
        return cls(raw.yaml, raw.path, raw.revision, raw.served_since.ToDatetime(datetime.timezone.utc),
                   raw.file_revision)


@dataclasses.dataclass(frozen=True)
class ConfigFinding:
    """What keeps a configuration from being served, and what to write instead. Line and column count from 1; 0: the file
    as a whole."""
    line: int
    column: int
    message: str
    suggestion: str

    @classmethod
    def of(cls, raw: system_service_pb2.ConfigFinding) -> ConfigFinding:
        return cls(raw.line, raw.column, raw.message, raw.suggestion)

    def __str__(self) -> str:
        return f"{self.line}:{self.column}: {self.message}" + (f"; {self.suggestion}" if self.suggestion else "")


@dataclasses.dataclass(frozen=True)
class ConfigCheck:
    """What would keep the daemon from serving a text; no finding: it could, and `warnings` are what its buses could not do
    then."""
    findings: tuple[ConfigFinding, ...]
    warnings: tuple[str, ...]

    @classmethod
    def of(cls, raw: system_service_pb2.CheckConfigResponse) -> ConfigCheck:
        return cls(tuple(ConfigFinding.of(found) for found in raw.findings), tuple(raw.warnings))


@dataclasses.dataclass(frozen=True)
class ConfigChange:
    """One part of the configuration that says something else than before. `kind`: "added", "removed" or "changed"; then
    `keys` names what, unless the section is a single value."""
    section: str
    name: str
    kind: str
    keys: tuple[str, ...]

    @classmethod
    def of(cls, raw: types_pb2.ConfigChange) -> ConfigChange:
        kind = types_pb2.ConfigChangeKind.Name(raw.kind).removeprefix("CONFIG_CHANGE_KIND_").lower()
        return cls(raw.section, raw.name, kind, tuple(raw.keys))

    def __str__(self) -> str:
        path = f"{self.section}.{self.name}" if self.name else self.section
        return f"{path} {self.kind}" + (f" ({', '.join(self.keys)})" if self.keys else "")


@dataclasses.dataclass(frozen=True)
class Reload:
    """What became of a reload. `applied` is False if nothing was changed: because of `findings` in the file or of
    `refusals`, each with what to do, or because it was only asked for what would become of it."""
    applied: bool
    findings: tuple[ConfigFinding, ...]
    changes: tuple[ConfigChange, ...]
    refusals: tuple[ErrorDetail, ...]
    previous_revision: str
    revision: str
    warnings: tuple[str, ...]

    @classmethod
    def of(cls, raw: system_service_pb2.ReloadConfigResponse) -> Reload:
        return cls(raw.applied, tuple(ConfigFinding.of(found) for found in raw.findings),
                   tuple(ConfigChange.of(change) for change in raw.changes),
                   tuple(ErrorDetail.of(refusal) for refusal in raw.refusals), raw.previous_revision, raw.revision,
                   tuple(raw.warnings))
