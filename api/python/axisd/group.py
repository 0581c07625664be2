"""Axes that start and stop together."""
from __future__ import annotations

import asyncio
import dataclasses
import datetime
import uuid
from collections.abc import Iterable, Mapping
from types import TracebackType
from typing import Any

import grpc

from .calls import Seconds, did_you_mean, duration, number
from .connection import Connection
from .errors import ArgumentError, AxisdError, MotionError, RefusedError, StopError
from .holds import StopHold
from .reasons import Outcome, Reason
from .types import Command, CommandState, ErrorDetail, StopResult, _member, _optional_error
from .v1 import group_service_pb2, types_pb2


def _seconds(raw: Any, name: str) -> float | None:
    value: datetime.timedelta = getattr(raw, name).ToTimedelta()
    return value.total_seconds() if raw.HasField(name) else None


@dataclasses.dataclass(frozen=True)
class GroupMember:
    """One axis of a group move. Times in seconds."""

    command: Command
    predicted_duration: float
    """From its start to its arrival; 0: it stands at its target."""
    by_sync: bool
    start_note: str
    """Why it does not start by a SYNC, where its bus has one."""
    started_after: float | None
    """After the first start of the group."""
    arrived_after: float | None
    """First seen at its target, after the first start of the group."""


@dataclasses.dataclass(frozen=True)
class GroupMove:
    """A move of several axes, as it stands. Times in seconds."""

    id: str
    group: str
    state: CommandState
    cause: ErrorDetail | None
    """What ended it, at the member where that happened."""
    members: dict[str, GroupMember]
    predicted_arrival_error: float
    start_skew: float | None
    arrival_error: float | None

    @classmethod
    def of(cls, raw: group_service_pb2.GroupMove) -> GroupMove:
        members = {
            member.command.axis: GroupMember(
                Command.of(member.command), member.predicted_duration.ToTimedelta().total_seconds(), member.by_sync,
                member.start_note, _seconds(member, "started_after"), _seconds(member, "arrived_after"))
            for member in raw.members}
        state = _member(CommandState, types_pb2.CommandState.DESCRIPTOR, "COMMAND_STATE_", raw.state)
        return cls(raw.id, raw.group, state, _optional_error(raw, "cause"), members,
                   raw.predicted_arrival_error.ToTimedelta().total_seconds(), _seconds(raw, "start_skew"),
                   _seconds(raw, "arrival_error"))

    def _worst(self) -> Command:
        """Of several that ended alike, one that was not only taken along."""
        order = (CommandState.UNKNOWN, CommandState.ERROR, CommandState.ABORTED)
        commands = [member.command for member in self.members.values()]
        return min(commands, key=lambda c: (order.index(c.state) if c.state in order else len(order),
                                            c.cause is not None and c.cause.reason is Reason.SUPERSEDED))


class Group:
    """A group of the configuration, or axes of this program's choice; made by Machine.group(). As an `async with` block
    it stops its axes when the block ends by an error or is cancelled."""

    def __init__(self, machine: Connection, name: str, axes: tuple[str, ...], lease_token: int) -> None:
        self._machine = machine
        self._axes = axes
        self._lease_token = lease_token
        self._targets: set[str] = set(axes)
        self.name = name

    async def __aenter__(self) -> Group:
        return self

    async def __aexit__(self, kind: type[BaseException] | None, error: BaseException | None,
                        traceback: TracebackType | None) -> None:
        if kind is None:
            return
        try:
            await asyncio.shield(self.stop())
        except AxisdError as failure:
            # That something may still move comes before what ended the block; a cancellation has to go on.
            if isinstance(error, Exception):
                raise failure from error
            if error is not None:
                error.add_note(str(failure))

    @property
    def _subject(self) -> str:
        return self.name or ", ".join(sorted(self._targets))

    def _check_names(self, targets: Mapping[str, float], velocity: Mapping[str, float]) -> None:
        """What no daemon sees: a velocity for nobody, and the members of a group that this program made up."""
        for axis in targets:
            if self._axes and not self.name and axis not in self._axes:
                raise ArgumentError(f"{self._subject}: '{axis}' is no member", did_you_mean(axis, self._axes))
        for axis in velocity:
            if axis not in targets:
                raise ArgumentError(f"a velocity is given for '{axis}', which has no target", did_you_mean(axis, targets))

    async def move(self, targets: Mapping[str, float], *, relative: bool = False, arrive_together: bool = False,
                   max_arrival_error: Seconds | None = None, velocity: Mapping[str, float] | None = None,
                   acceleration_time: Seconds | None = None, deceleration_time: Seconds | None = None,
                   wait: bool = True, request_id: str | None = None) -> GroupMove:
        """Moves axes, by name, to positions (or by distances). Waits until all members have ended, unless
        `wait` is False. `velocity`: of single axes, in place of their limits. Raises RefusedError where it is refused
        (ArgumentError for a name that is no member), MotionError with the command of the member that failed where the
        move ended otherwise than Done."""
        self._check_names(targets, velocity or {})
        request = group_service_pb2.MoveGroupRequest(
            group=self.name, arrive_together=arrive_together, max_arrival_error=duration(max_arrival_error),
            options=types_pb2.CommandOptions(
                request_id=request_id or str(uuid.uuid4()), lease_token=self._lease_token,
                wait_until=types_pb2.WAIT_UNTIL_DONE if wait else types_pb2.WAIT_UNTIL_ACCEPTED))
        for axis, value in targets.items():
            target = request.targets.add(axis=axis, acceleration_time=duration(acceleration_time),
                                         deceleration_time=duration(deceleration_time))
            if relative:
                target.distance = number(axis, value)
            else:
                target.position = number(axis, value)
            if velocity is not None and axis in velocity:
                target.velocity = number(f"velocity of {axis}", velocity[axis])
        added = set() if self.name else set(targets) - self._targets
        self._targets |= added
        try:
            response = await self._machine._call(self._machine._groups.MoveGroup, request, self._subject, wait)
        except RefusedError as refusal:
            if refusal.detail is not None and refusal.detail.outcome is Outcome.NOT_SENT:
                self._targets -= added  # nothing of it may move: a stop need not look for a name that there is not
            raise
        move = GroupMove.of(response.move)
        if move.state.ended and move.state is not CommandState.DONE:
            raise MotionError(move._worst())
        return move

    async def halt(self, wait: bool = True) -> dict[str, Command]:
        """Decelerates each axis. A new move may take over. As stop() otherwise."""
        request = group_service_pb2.GroupHaltRequest(group=self.name, axes=sorted(self._targets),
                                                     wait_until=types_pb2.WAIT_UNTIL_DONE if wait
                                                     else types_pb2.WAIT_UNTIL_ACCEPTED)
        return await self._stop(self._machine._stops.GroupHalt, request, wait)

    async def stop(self, hold: bool = False, wait: bool = True) -> dict[str, Command]:
        """Stops each axis; nothing takes over before standstill, with `hold` before release_stop(). Raises StopError
        unless every one has confirmed its standstill (without `wait`: has accepted the stop); all that are known are
        stopped in any case. Repeated, up to the machine's `timeout`, while the daemon cannot be reached."""
        holds, subject = self._machine._holds, self._hold_subject
        name = holds.fresh(subject, None)
        if hold:
            # Before it is sent: a stop without an answer may hold, too.
            holds.add(subject, name)
        request = group_service_pb2.GroupStopRequest(group=self.name, axes=sorted(self._targets), hold=hold,
                                                     request_id=name,
                                                     wait_until=types_pb2.WAIT_UNTIL_DONE if wait
                                                     else types_pb2.WAIT_UNTIL_ACCEPTED)
        return await self._stop(self._machine._stops.GroupStop, request, wait)

    @property
    def _hold_subject(self) -> str:
        """No axis is called so."""
        return f"group {self.name or id(self)}"

    async def release_stop(self, *, mine: bool = False, everybody: bool = False) -> dict[str, tuple[StopHold, ...]]:
        """Ends what stop() of this group holds; who holds each axis still. `mine` and `everybody` as of
        Axis.release_stop(). Raises RefusedError for the first axis where that was not possible, once all were tried."""
        names = self._machine._holds.of(self._hold_subject)
        left: dict[str, tuple[StopHold, ...]] = {}
        for name in [""] if mine or everybody or not names else names:
            request = group_service_pb2.GroupReleaseStopRequest(
                group=self.name, axes=sorted(self._targets), request_id=name, mine=mine, everybody=everybody,
                lease_token=self._lease_token)
            response = await self._machine._call(self._machine._groups.GroupReleaseStop, request, self._subject)
            for result in response.results:
                error = _optional_error(result, "error")
                left[result.name] = tuple(StopHold.of(hold) for hold in result.holds)
                # Somebody else released it already, or it never arrived.
                if error is not None and not (name and error.reason is Reason.INVALID_ARGUMENT):
                    raise RefusedError(str(error), grpc.StatusCode.FAILED_PRECONDITION, error)
            self._forget(name, left)
        if mine or everybody:
            for name in names:
                self._forget(name, left)
        return left

    def _forget(self, name: str, axes: Iterable[str]) -> None:
        for subject in (self._hold_subject, *axes):
            self._machine._holds.drop(subject, name)

    async def _stop(self, method: Any, request: Any, wait: bool) -> dict[str, Command]:
        response = await self._machine._stop_call(method, request, self._subject, wait)
        results = tuple(StopResult.of(result) for result in response.results)
        commands: dict[str, Command] = {}
        failed: list[StopResult] = []
        for result in results:
            if result.command is not None and getattr(request, "hold", False):
                self._machine._holds.add(result.axis, request.request_id)  # Axis.release_stop() ends it, too
            if result.command is not None and (result.confirmed or not wait and not result.command.state.ended):
                commands[result.axis] = result.command
            else:
                failed.append(result)
        if failed:
            raise StopError(self._subject, results, tuple(failed))
        return commands
