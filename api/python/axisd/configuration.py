"""What the daemon serves, and what it says of another configuration."""
from __future__ import annotations

import dataclasses
import datetime

from .v1 import system_service_pb2


@dataclasses.dataclass(frozen=True)
class Configuration:
    """The file that the daemon was started with, as it was then. Equal texts have equal revisions."""
    yaml: str
    path: str
    revision: str
    served_since: datetime.datetime

    @classmethod
    def of(cls, raw: system_service_pb2.GetConfigResponse) -> Configuration:
        return cls(raw.yaml, raw.path, raw.revision, raw.served_since.ToDatetime(datetime.timezone.utc))


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
