"""An axis and its motions."""
from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import uuid
from collections.abc import AsyncGenerator, Iterable
from types import TracebackType
from typing import Any, Literal, get_args

from .calls import Seconds, command_options, did_you_mean, done, duration, number
from .connection import Connection
from .drive import Drive
from .errors import ArgumentError, AxisdError, MotionError, RefusedError
from .holds import StopHold
from .reasons import Reason
from .types import AxisState, Command, Link, Obstacle, in_cell
from .v1 import axis_service_pb2, system_service_pb2, types_pb2

Explainable = Literal["enable", "disable", "home", "move", "move_relative", "velocity", "jog", "reset", "set_position"]
_RAMPS = ("acceleration_time", "deceleration_time")
_LONGEST_HOLD = 2.0  # s
# What explain() takes for a command, beside its name.
_EXPLAINED = {"move": ("value", "velocity", *_RAMPS), "move_relative": ("value", "velocity", *_RAMPS),
              "velocity": ("value", "hold", *_RAMPS), "jog": ("value", "hold", *_RAMPS), "set_position": ("value",)}


class Axis:
    """One axis. Motion calls wait until the command is Done and raise MotionError if it ends otherwise; with
    wait=False they return once it is accepted (then: Machine.wait). Cancelling such a call in Python does not end the
    motion: halt() or stop() does. `request_id` repeats an earlier call without moving twice."""

    def __init__(self, machine: Connection, name: str, lease_token: int = 0) -> None:
        self._machine = machine
        self._lease_token = lease_token
        self.name = name
        self.drive = Drive(machine, name, lease_token)

    def __repr__(self) -> str:
        member = self._machine._member
        return f"Axis({f'{member}/{self.name}' if member else self.name!r} at {self._machine.server})"

    async def _command(self, method: Any, request: Any, wait: bool) -> Command:
        request.options.lease_token = self._lease_token
        answer = await self._machine._call(method, request, self.name, wait)
        return done(Command.of(answer.command), self._machine._member or "")

    async def _stop(self, method: Any, request: Any, wait: bool) -> Command:
        answer = await self._machine._stop_call(method, request, self.name, wait)
        return done(Command.of(answer.command), self._machine._member or "")

    async def state(self) -> AxisState:
        """The latest state, without touching the bus."""
        request = axis_service_pb2.GetAxisRequest(axis=self.name)
        return AxisState.of((await self._machine._call(self._machine._axes.GetAxis, request, self.name)).state)

    async def watch(self, period: Seconds = 0.1, fields: Iterable[str] = ()) -> AsyncGenerator[AxisState, None]:
        """The latest state at a steady rate; `fields` as of Machine.watch()."""
        async with contextlib.aclosing(self._machine.watch([self.name], period, fields)) as ticks:
            async for tick in ticks:
                yield tick.axes[self.name]

    async def wait_online(self) -> AxisState:
        """Waits until the drive answers and is configured, as enable() needs it; without a time limit of its own. A
        drive whose terminals can start a motion is configured without power only: disable() it first."""
        async with contextlib.aclosing(self.watch()) as states:
            async for state in states:
                if state.link is Link.ONLINE:
                    return state
        raise AxisdError(f"{self.name}: the daemon ended the stream before the drive was online")

    async def enable(self, *, wait: bool = True, request_id: str | None = None) -> Command:
        """Switches the power stage on. Never moves."""
        request = axis_service_pb2.EnableRequest(axis=self.name, options=command_options(request_id, wait))
        return await self._command(self._machine._axes.Enable, request, wait)

    async def disable(self, *, wait: bool = True, request_id: str | None = None) -> Command:
        """Stops, waits for standstill, switches the power stage off."""
        request = axis_service_pb2.DisableRequest(axis=self.name, options=command_options(request_id, wait))
        return await self._command(self._machine._stops.Disable, request, wait)

    async def home(self, *, wait: bool = True, buffered: bool = False, request_id: str | None = None) -> Command:
        """Searches the home position as configured."""
        request = axis_service_pb2.HomeRequest(axis=self.name, options=command_options(request_id, wait, buffered))
        return await self._command(self._machine._axes.Home, request, wait)

    async def move(self, position: float, *, velocity: float | None = None, acceleration_time: Seconds | None = None,
                   deceleration_time: Seconds | None = None, wait: bool = True, buffered: bool = False,
                   request_id: str | None = None) -> Command:
        """Moves to a position."""
        request = axis_service_pb2.MoveAbsoluteRequest(
            axis=self.name, position=number("position", position), velocity=number("velocity", velocity),
            acceleration_time=duration(acceleration_time),
            deceleration_time=duration(deceleration_time), options=command_options(request_id, wait, buffered))
        return await self._command(self._machine._axes.MoveAbsolute, request, wait)

    async def move_relative(self, distance: float, *, velocity: float | None = None,
                            acceleration_time: Seconds | None = None, deceleration_time: Seconds | None = None,
                            wait: bool = True, buffered: bool = False, request_id: str | None = None) -> Command:
        """Moves by a distance."""
        request = axis_service_pb2.MoveRelativeRequest(
            axis=self.name, distance=number("distance", distance), velocity=number("velocity", velocity),
            acceleration_time=duration(acceleration_time),
            deceleration_time=duration(deceleration_time), options=command_options(request_id, wait, buffered))
        return await self._command(self._machine._axes.MoveRelative, request, wait)

    async def velocity(self, velocity: float, *, hold: Seconds | None = None,
                       acceleration_time: Seconds | None = None, deceleration_time: Seconds | None = None,
                       wait: bool = False, request_id: str | None = None) -> Command:
        """Moves at a velocity until something ends it; with `hold`, until it is not repeated in time."""
        request = axis_service_pb2.MoveVelocityRequest(
            axis=self.name, velocity=number("velocity", velocity), hold=duration(hold),
            acceleration_time=duration(acceleration_time),
            deceleration_time=duration(deceleration_time), options=command_options(request_id, wait))
        return await self._command(self._machine._axes.MoveVelocity, request, wait)

    def jog(self, velocity: float, *, hold: float = 0.3, acceleration_time: Seconds | None = None,
            deceleration_time: Seconds | None = None) -> Jog:
        """Moves inside an `async with` block and halts at its end. If this program dies or hangs, the axis halts by
        itself after `hold` seconds (at most 2)."""
        return Jog(self, velocity, hold, acceleration_time, deceleration_time)

    async def halt(self, *, wait: bool = True) -> Command:
        """Decelerates; a new move may take over. As stop() and quick_stop() repeated, up to the machine's `timeout`,
        while the daemon cannot be reached: what was commanded meanwhile is stopped, too."""
        request = axis_service_pb2.HaltRequest(axis=self.name, options=command_options(None, wait))
        return await self._stop(self._machine._stops.Halt, request, wait)

    async def stop(self, *, hold: bool = False, wait: bool = True, request_id: str | None = None) -> Command:
        """Decelerates; nothing takes over before standstill (with `hold`: before release_stop(), and before everybody else
        who holds has released, also over a restart of the daemon). `request_id`: the name of the hold, for another program
        to release it by."""
        request = axis_service_pb2.StopRequest(axis=self.name, hold=hold, options=self._stop_options(hold, wait, request_id))
        return await self._stop(self._machine._stops.Stop, request, wait)

    async def quick_stop(self, *, hold: bool = False, wait: bool = True, request_id: str | None = None) -> Command:
        """Stops as hard as the drive does: without deceleration, or on the ramp that it has for it, whose time is granted
        then. Open loop: the position is no longer trusted. Otherwise as stop()."""
        request = axis_service_pb2.QuickStopRequest(axis=self.name, hold=hold,
                                                    options=self._stop_options(hold, wait, request_id))
        return await self._stop(self._machine._stops.QuickStop, request, wait)

    def _stop_options(self, hold: bool, wait: bool, request_id: str | None) -> types_pb2.CommandOptions:
        if hold:
            # Before it is sent: a stop without an answer may hold, too.
            request_id = self._machine._holds.fresh(self.name, request_id)
            self._machine._holds.add(self.name, request_id)
        return command_options(request_id, wait)

    async def release_stop(self, request_id: str | None = None, *, mine: bool = False,
                           everybody: bool = False) -> tuple[StopHold, ...]:
        """Ends the stops that this connection holds; who holds the axis still. Without any: that of the stops without a
        name (`axisctl stop --hold`). `request_id`: the one of this name, of any program with this client's identity; `mine`:
        all of that identity; `everybody`: all there are, for whoever may command the axis (an event tells of it)."""
        names = self._machine._holds.of(self.name)
        if request_id is None and not mine and not everybody and names:
            left: tuple[StopHold, ...] = ()
            for name in names:
                left = await self._release(name)
            return left
        request = axis_service_pb2.ReleaseStopRequest(axis=self.name, request_id=request_id or "", mine=mine,
                                                      everybody=everybody, lease_token=self._lease_token)
        response = await self._machine._call(self._machine._axes.ReleaseStop, request, self.name)
        for name in names:
            if mine or everybody or name == request_id:
                self._machine._holds.drop(self.name, name)
        return tuple(StopHold.of(hold) for hold in response.holds)

    async def _release(self, name: str) -> tuple[StopHold, ...]:
        """One that this connection holds, unless somebody else released it already, or it never arrived."""
        request = axis_service_pb2.ReleaseStopRequest(axis=self.name, request_id=name)
        try:
            response = await self._machine._call(self._machine._axes.ReleaseStop, request, self.name)
        except RefusedError as refusal:
            if refusal.reason is not Reason.INVALID_ARGUMENT:
                raise
            self._machine._holds.drop(self.name, name)
            return (await self.state()).holds
        self._machine._holds.drop(self.name, name)
        return tuple(StopHold.of(hold) for hold in response.holds)

    async def explain(self, command: Explainable | None = None, value: float | None = None, *,
                      velocity: float | None = None, hold: Seconds | None = None,
                      acceleration_time: Seconds | None = None,
                      deceleration_time: Seconds | None = None) -> list[Obstacle]:
        """Why the axis cannot move, or a command would be refused, now: everything in its way, in the order of the
        refusals. `command` is the name of a method of this class (stops are never refused); `value` is what that takes:
        a position, a distance or a velocity. Asks no drive."""
        request = system_service_pb2.ExplainRequest(axis=self.name, lease_token=self._lease_token)
        given = {"value": value, "velocity": velocity, "hold": hold, "acceleration_time": acceleration_time,
                 "deceleration_time": deceleration_time}
        if command is not None and command not in get_args(Explainable):
            raise ArgumentError(f"{command!r} is no command", did_you_mean(command, get_args(Explainable)))
        for name, argument in given.items():
            if argument is not None and name not in _EXPLAINED.get(command or "", ()):
                raise ArgumentError(f"{name} does not belong to {command or 'motion in general'}", "leave it out")
        value, velocity = number("value", value), number("velocity", velocity)
        ramps = {"acceleration_time": duration(acceleration_time), "deceleration_time": duration(deceleration_time)}
        if command == "move":
            request.move_absolute.CopyFrom(
                axis_service_pb2.MoveAbsoluteRequest(position=value, velocity=velocity, **ramps))
        elif command == "move_relative":
            request.move_relative.CopyFrom(
                axis_service_pb2.MoveRelativeRequest(distance=value, velocity=velocity, **ramps))
        elif command == "velocity":
            request.move_velocity.CopyFrom(
                axis_service_pb2.MoveVelocityRequest(velocity=value, hold=duration(hold), **ramps))
        elif command == "jog":
            request.jog.CopyFrom(axis_service_pb2.JogRequest(velocity=value, hold=duration(hold), **ramps))
        elif command == "set_position":
            request.set_position.CopyFrom(axis_service_pb2.SetPositionRequest(position=value))
        elif command is not None:
            getattr(request, command).SetInParent()
        response = await self._machine._call(self._machine._system.Explain, request, self.name)
        told = [Obstacle.of(obstacle) for obstacle in response.obstacles]
        member = self._machine._member
        return [dataclasses.replace(one, remedy=in_cell(one.remedy, member, self.name)) for one in told] if member else told

    async def reset(self, *, wait: bool = True, request_id: str | None = None) -> Command:
        """Leaves ErrorStop if the cause is gone. Never moves."""
        request = axis_service_pb2.ResetRequest(axis=self.name, options=command_options(request_id, wait))
        return await self._command(self._machine._axes.Reset, request, wait)

    async def set_position(self, position: float, *, wait: bool = True, request_id: str | None = None) -> Command:
        """Declares the present position; at standstill only."""
        request = axis_service_pb2.SetPositionRequest(axis=self.name, position=number("position", position),
                                                      options=command_options(request_id, wait))
        return await self._command(self._machine._axes.SetPosition, request, wait)


class Jog:
    """A jog in progress; made by Axis.jog(). `command` is the latest answer of the daemon, inside the block."""
    command: Command

    def __init__(self, axis: Axis, velocity: float, hold: float, acceleration_time: Seconds | None,
                 deceleration_time: Seconds | None) -> None:
        self._axis = axis
        self._hold = hold
        self._arguments: dict[str, Any] = {
            "axis": axis.name, "velocity": number("velocity", velocity), "hold": duration(hold),
            "acceleration_time": duration(acceleration_time), "deceleration_time": duration(deceleration_time)}
        self._request_id = str(uuid.uuid4())
        self._renewal: asyncio.Task[None] | None = None

    async def __aenter__(self) -> Jog:
        self.command = await self._call()
        self._renewal = asyncio.create_task(self._renew())
        return self

    async def __aexit__(self, kind: type[BaseException] | None, error: BaseException | None,
                        traceback: TracebackType | None) -> None:
        """Halts. Raises what ended the jog early, unless the block itself raised."""
        assert self._renewal is not None
        failed = self._renewal.done()
        self._renewal.cancel()
        failure = (await asyncio.gather(self._renewal, return_exceptions=True))[0]
        # A jog that ended by itself may have been followed by somebody else's motion: that is not ours to halt.
        if not failed or isinstance(failure, AxisdError) and not isinstance(failure, MotionError):
            try:
                # Where its renewal failed nobody has to wait for the daemon: the axis halts when its hold ends.
                async with asyncio.timeout(_LONGEST_HOLD if failed else None):
                    await self._axis.halt()
            except (AxisdError, TimeoutError):
                if not failed:
                    raise
        if failed and error is None and isinstance(failure, Exception):
            raise failure

    def check(self) -> None:
        """Raises what ended the jog early, if anything did; so does the end of the block."""
        if self._renewal is not None and self._renewal.done():
            self._renewal.result()

    async def _call(self) -> Command:
        # The same id each time: a repeat extends the hold, and never starts a jog anew that has ended.
        request = axis_service_pb2.JogRequest(**self._arguments, options=command_options(self._request_id, wait=False))
        return await self._axis._command(self._axis._machine._stops.Jog, request, wait=False)

    async def _renew(self) -> None:
        # Three renewals per hold: two may be late or lost before the axis halts.
        while True:
            await asyncio.sleep(self._hold / 3)
            self.command = await self._call()
            if self.command.state.ended:
                return
