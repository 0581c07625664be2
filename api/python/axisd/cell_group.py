"""Moves of axes of several machines."""
from __future__ import annotations

import dataclasses
import uuid
from collections.abc import Mapping

from .calls import Seconds, did_you_mean, duration
from .cell.v1 import cell_service_pb2 as cell_pb
from .cell_lease import CellLease, split
from .errors import ArgumentError, MotionError
from .group import GroupMove, _seconds
from .types import Command, CommandState, ErrorDetail, _member, _optional_error
from .v1 import types_pb2


@dataclasses.dataclass(frozen=True)
class MachineMove:
    """What one machine does of a move. Times in seconds."""

    machine: str
    move: GroupMove
    """As the machine tells it; names of axes are without the machine's."""
    error: ErrorDetail | None
    """Why it refused its part, or does not answer."""
    clock_offset: float | None
    """Of its clock from the entrance's."""
    clock_error: float | None
    """By which that is off at most."""
    started_after: float | None
    """Its first start after the first one of all."""


@dataclasses.dataclass(frozen=True)
class CellMove:
    """A move of axes of several machines, as it stands. Times in seconds."""

    state: CommandState
    cause: ErrorDetail | None
    """What ended it: of the machine that was the first."""
    machines: dict[str, MachineMove]
    start_skew: float | None
    """Between the first and the last start frame of all. None: not all have started, or another entrance coordinates it."""
    start_skew_error: float | None
    """By which `start_skew` is off at most, as clocks are known no better."""

    @classmethod
    def of(cls, raw: cell_pb.CellGroupMove) -> CellMove:
        machines = {
            each.machine: MachineMove(
                each.machine, GroupMove.of(each.move), _optional_error(each, "error"), _seconds(each, "clock_offset"),
                _seconds(each, "clock_error"), _seconds(each, "started_after"))
            for each in raw.machines}
        state = _member(CommandState, types_pb2.CommandState.DESCRIPTOR, "COMMAND_STATE_", raw.state)
        return cls(state, _optional_error(raw, "cause"), machines, _seconds(raw, "start_skew"),
                   _seconds(raw, "start_skew_error"))

    def failure(self) -> MotionError | None:
        """Of the member that ended it; None: it has not ended, or is done."""
        if not self.state.ended or self.state is CommandState.DONE:
            return None
        worst = [(each.move._worst(), each.machine) for each in self.machines.values() if each.move.members]

        def rank(found: tuple[Command, str]) -> tuple[bool, bool]:
            command, machine = found
            culprit = self.cause is not None and self.cause.message.startswith(f"{machine}:")
            return not culprit, not (command.state.ended and command.state is not CommandState.DONE)
        command, machine = min(worst, key=rank)
        if not command.state.ended or command.state is CommandState.DONE:  # its machine does not say what became of it
            command = dataclasses.replace(command, state=self.state, cause=self.cause)
        return MotionError(command, machine)


def request_of(targets: Mapping[str, float], relative: bool, velocity: Mapping[str, float],
               acceleration_time: Seconds | None, deceleration_time: Seconds | None, clock_tolerance: Seconds | None,
               lease: CellLease | None, wait: bool, request_id: str | None) -> cell_pb.MoveGroupRequest:
    for name in velocity:
        if name not in targets:
            raise ArgumentError(f"a velocity is given for '{name}', which has no target", did_you_mean(name, targets))
    request = cell_pb.MoveGroupRequest(
        clock_tolerance=duration(clock_tolerance),
        options=types_pb2.CommandOptions(
            request_id=request_id or str(uuid.uuid4()),
            wait_until=types_pb2.WAIT_UNTIL_DONE if wait else types_pb2.WAIT_UNTIL_ACCEPTED))
    parts: dict[str, cell_pb.MachineTargets] = {}
    for name, value in targets.items():
        machine, axis = split(name)
        if machine not in parts:
            parts[machine] = request.machines.add(machine=machine,
                                                  lease_token=lease.tokens.get(machine, 0) if lease else 0)
        target = parts[machine].targets.add(axis=axis, acceleration_time=duration(acceleration_time),
                                            deceleration_time=duration(deceleration_time))
        if relative:
            target.distance = value
        else:
            target.position = value
        if name in velocity:
            target.velocity = velocity[name]
    return request
