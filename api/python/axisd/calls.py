"""What the calls of a machine and of its axes have in common."""
from __future__ import annotations

import datetime
import difflib
import uuid
from collections.abc import Iterable
from typing import TypeVar

from google.protobuf.duration_pb2 import Duration

from .errors import ArgumentError, MotionError
from .types import Command, CommandState
from .v1 import types_pb2

Seconds = float | datetime.timedelta
_Number = TypeVar("_Number")


def duration(value: Seconds | None) -> Duration | None:
    if value is None:
        return None
    delta = value if isinstance(value, datetime.timedelta) else datetime.timedelta(seconds=value)
    message = Duration()
    message.FromTimedelta(delta)
    return message


def number(argument: str, value: _Number) -> _Number:
    """What protobuf takes for a number. Raises ArgumentError: it is a text, say."""
    if value is None or hasattr(value, "__float__"):
        return value
    raise ArgumentError(f"{argument}: {value!r} is no number", "write it without a unit: the axis's own is meant")


def names(axes: Iterable[str]) -> list[str]:
    """A single name is one name, not its letters."""
    return [axes] if isinstance(axes, str) else list(axes)


def did_you_mean(name: str, candidates: Iterable[str]) -> str:
    """What to do about a name that is none of these."""
    known = sorted(candidates)
    near = difflib.get_close_matches(name.lower(), known, n=1)
    return f"did you mean '{near[0]}'?" if near else f"there are {', '.join(known)}"


def command_options(request_id: str | None, wait: bool, buffered: bool = False) -> types_pb2.CommandOptions:
    return types_pb2.CommandOptions(
        request_id=request_id or str(uuid.uuid4()),
        wait_until=types_pb2.WAIT_UNTIL_DONE if wait else types_pb2.WAIT_UNTIL_ACCEPTED,
        buffer_mode=types_pb2.BUFFER_MODE_BUFFERED if buffered else types_pb2.BUFFER_MODE_UNSPECIFIED)


def done(command: Command, machine: str = "") -> Command:
    """The command, unless it ended otherwise than Done: then MotionError. `machine`: of a cell."""
    if command.state.ended and command.state is not CommandState.DONE:
        raise MotionError(command, machine)
    return command
