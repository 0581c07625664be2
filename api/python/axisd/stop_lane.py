"""The stop lane of a daemon: stops, jogs and renewals at an address of their own (stop_service.proto)."""
from __future__ import annotations

import asyncio
import re
from collections.abc import Awaitable, Callable
from typing import Any

import grpc
import grpc.aio

from .errors import detail_of
from .reasons import Reason
from .v1 import (axis_service_pb2_grpc, command_service_pb2_grpc, group_service_pb2_grpc, lease_service_pb2_grpc,
                 stop_service_pb2_grpc, system_service_pb2_grpc)

#: How long a connection to the lane may take before the main address is asked (s).
_PATIENCE = 0.3


def _is_for_the_main_address(error: grpc.aio.AioRpcError, repeatable: bool) -> bool:
    """Whoever has that port may be something else altogether: only an answer of axisd's counts."""
    if error.code() is grpc.StatusCode.UNIMPLEMENTED:
        return True
    detail = detail_of(error)
    return repeatable and (detail is None or detail.reason is Reason.UNKNOWN_AXIS)


def stop_lane_of(server: str) -> str | None:
    """Where a daemon takes stops, unless its configuration says otherwise. None: `server` has no port."""
    if server.startswith("unix:"):
        return server + ".stop"
    port = re.fullmatch(r"(.+):(\d{1,5})", server)
    if port is None or not 0 < int(port[2]) < 65535:
        return None
    return f"{port[1]}:{int(port[2]) + 1}"


class StopLane:
    """Each call goes to the lane, and to the main address where the lane does not take it."""

    def __init__(self, channel: grpc.aio.Channel | None) -> None:
        self._channel = channel
        self._lane = stop_service_pb2_grpc.StopServiceStub(channel) if channel is not None else None
        self._deaf = False  # it was waited for in vain

    def call(self, name: str, main: Callable[..., Awaitable[Any]]) -> Callable[..., Awaitable[Any]]:
        """The method `name` of StopService; `main`: the same of the main address."""
        if self._lane is None:
            return main
        lane = getattr(self._lane, name)
        # What may have been lost is asked for again, but for Disable: it lets go of the load.
        repeatable = name != "Disable"

        async def either(request: Any, timeout: float | None = None,
                         metadata: tuple[tuple[str, str], ...] = ()) -> Any:
            self._deaf = not await self._is_reachable()
            if not self._deaf:
                try:  # half of the time is left for the main address
                    return await lane(request, timeout=timeout / 2 if timeout and repeatable else timeout,
                                      metadata=metadata)
                except grpc.aio.AioRpcError as error:
                    if not _is_for_the_main_address(error, repeatable):
                        raise
            return await main(request, timeout=timeout, metadata=metadata)

        return either

    async def _is_reachable(self) -> bool:
        assert self._channel is not None
        loop = asyncio.get_running_loop()
        until = loop.time() + (0 if self._deaf else _PATIENCE)
        while True:
            state = self._channel.get_state(try_to_connect=True)
            if state is grpc.ChannelConnectivity.READY:
                return True
            if state in (grpc.ChannelConnectivity.TRANSIENT_FAILURE, grpc.ChannelConnectivity.SHUTDOWN):
                return False
            try:
                await asyncio.wait_for(self._channel.wait_for_state_change(state), max(until - loop.time(), 0))
            except asyncio.TimeoutError:
                return False


class StopCalls:
    """What StopService takes, by the names of its methods. `main`: a channel to the main address."""

    def __init__(self, lane: StopLane, main: grpc.aio.Channel) -> None:
        axes = axis_service_pb2_grpc.AxisServiceStub(main)
        self.Halt = lane.call("Halt", axes.Halt)
        self.Stop = lane.call("Stop", axes.Stop)
        self.QuickStop = lane.call("QuickStop", axes.QuickStop)
        self.Disable = lane.call("Disable", axes.Disable)
        self.Jog = lane.call("Jog", axes.Jog)
        groups = group_service_pb2_grpc.GroupServiceStub(main)
        self.GroupHalt = lane.call("GroupHalt", groups.GroupHalt)
        self.GroupStop = lane.call("GroupStop", groups.GroupStop)
        self.RenewPrepared = lane.call("RenewPrepared", groups.RenewPrepared)
        self.StopAll = lane.call("StopAll", system_service_pb2_grpc.SystemServiceStub(main).StopAll)
        self.RenewLease = lane.call("RenewLease", lease_service_pb2_grpc.LeaseServiceStub(main).RenewLease)
        self.CancelCommand = lane.call("CancelCommand",
                                       command_service_pb2_grpc.CommandServiceStub(main).CancelCommand)
