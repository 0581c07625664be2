"""Calls to one daemon, as an axis, a group, a drive and a lease make them."""
from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncGenerator, Iterable
from typing import Any

import grpc
import grpc.aio
from google.protobuf.field_mask_pb2 import FieldMask

from . import tls_trouble
from .calls import Seconds, duration, names
from .errors import RefusedError, UnreachableError, translate
from .holds import Holds
from .reasons import Reason
from .stop_lane import StopCalls, StopLane
from .tls_files import TlsFiles
from .types import Tick
from .v1 import (audit_service_pb2_grpc, axis_service_pb2, axis_service_pb2_grpc, bus_service_pb2_grpc,
                 command_service_pb2_grpc, drive_service_pb2_grpc, event_service_pb2_grpc, group_service_pb2_grpc,
                 lease_service_pb2_grpc, system_service_pb2_grpc)

_OPTIONS = (
    # The daemon permits one ping per second.
    ("grpc.keepalive_time_ms", 2000),
    ("grpc.keepalive_timeout_ms", 1000),
    ("grpc.keepalive_permit_without_calls", 1),
    ("grpc.http2.max_pings_without_data", 0),
    # A machine is on the local network; a proxy of the environment must not redirect its commands.
    ("grpc.enable_http_proxy", 0),
    # A call that failed is reported, never sent again by itself: only stops are, by Connection._stop_call().
    ("grpc.enable_retries", 0),
    # A daemon that is being restarted is found again soon; gRPC's own pauses grow to two minutes.
    ("grpc.initial_reconnect_backoff_ms", 100),
    ("grpc.max_reconnect_backoff_ms", 1000),
    # Two channels of one process would share a connection otherwise: stops have one of their own.
    ("grpc.use_local_subchannel_pool", 1),
)


def channel_to(address: str, credentials: grpc.ChannelCredentials | None) -> grpc.aio.Channel:
    """With a connection of its own, made by the first call."""
    if credentials is None:
        return grpc.aio.insecure_channel(address, options=_OPTIONS)
    return grpc.aio.secure_channel(address, credentials, options=_OPTIONS)


# Between two attempts of a stop (s).
_FIRST_PAUSE = 0.05
_LONGEST_PAUSE = 0.5


class Connection:
    """One daemon, and how it is asked. What can be asked of it, Machine and its parts know."""

    def __init__(self, server: str, tls: TlsFiles, timeout: float, stop_server: str | None = None,
                 speak_for: str | None = None, role: str | None = None) -> None:
        if role is not None and speak_for is None:
            raise ValueError("role needs speak_for: one's own is the daemon's to say")
        self.server = server
        self.stop_server = stop_server
        self.timeout = timeout
        self._tls = tls
        self._credentials = tls.credentials()
        claim = {"axisd-user": speak_for, "axisd-role": role}
        self._metadata = tuple((key, value) for key, value in claim.items() if value is not None)
        self._channels: list[grpc.aio.Channel] = []
        self._holds = Holds()
        self._member: str | None = None
        """Its name in a cell, whose entrance `server` is."""

    def _use(self, ordinary: grpc.aio.Channel, stops: grpc.aio.Channel, lane: grpc.aio.Channel | None) -> None:
        self._axes = axis_service_pb2_grpc.AxisServiceStub(ordinary)
        self._commands = command_service_pb2_grpc.CommandServiceStub(ordinary)
        self._buses = bus_service_pb2_grpc.BusServiceStub(ordinary)
        self._drives = drive_service_pb2_grpc.DriveServiceStub(ordinary)
        self._audit = audit_service_pb2_grpc.AuditServiceStub(ordinary)
        self._events = event_service_pb2_grpc.EventServiceStub(ordinary)
        self._leases = lease_service_pb2_grpc.LeaseServiceStub(ordinary)
        self._groups = group_service_pb2_grpc.GroupServiceStub(ordinary)
        self._system = system_service_pb2_grpc.SystemServiceStub(ordinary)
        self._stops = StopCalls(StopLane(lane), stops)

    async def _in_words(self, error: UnreachableError, subject: str) -> UnreachableError:
        """The same error, with what is wrong with the certificates where it is that: behind its own words where something
        may have been sent."""
        why = await asyncio.to_thread(tls_trouble.why, self.server, self._tls)
        if why is None:
            return error
        if not error.nothing_sent:
            return UnreachableError(f"{error}; {why}", error.request_id)
        lead = f"{subject}: " if subject else ""
        asked = "axisd" if self._member is None else "axisd-cell"
        return UnreachableError(f"{lead}cannot reach {asked} at {self.server}: {why}", error.request_id,
                                error.nothing_sent)

    async def _call(self, method: Any, request: Any, subject: str, wait: bool = False,
                    limit: float | None = None) -> Any:
        """One call; waiting for a motion has no time limit, keep-alive notices a daemon that is gone."""
        try:
            return await self._attempt(method, request, subject, wait, limit)
        except UnreachableError as error:
            raise await self._in_words(error, subject) from None

    async def _attempt(self, method: Any, request: Any, subject: str, wait: bool, limit: float | None) -> Any:
        try:
            return await method(request, timeout=None if wait else limit or self.timeout, metadata=self._metadata)
        except grpc.aio.AioRpcError as error:
            options = getattr(request, "options", None)
            request_id = options.request_id if options is not None else ""
            raise translate(error, subject, self.server, request_id, self._member) from None

    async def _stop_call(self, method: Any, request: Any, subject: str, wait: bool = False) -> Any:
        """A stop: repeated as it is, until one call is answered or `timeout` is over. To stop twice is harmless."""
        loop = asyncio.get_running_loop()
        deadline = loop.time() + self.timeout
        pause = _FIRST_PAUSE
        unsent = True
        while True:
            try:
                return await self._attempt(method, request, subject, wait, max(deadline - loop.time(), _FIRST_PAUSE))
            except UnreachableError as error:
                unsent = unsent and error.nothing_sent
                if loop.time() + pause > deadline:
                    known = "it never arrived" if unsent else "whether it arrived is not known"
                    error = await self._in_words(error, subject)
                    raise UnreachableError(f"{error}; the stop was repeated for {self.timeout:g} s: {known}",
                                           error.request_id, unsent) from None
            except RefusedError as error:
                unsent = False
                if error.reason is not Reason.CANCELLED or loop.time() + pause > deadline:
                    raise
            await asyncio.sleep(pause)
            pause = min(2 * pause, _LONGEST_PAUSE)

    async def _stream(self, method: Any, request: Any, subject: str) -> AsyncGenerator[Any, None]:
        call = method(request, metadata=self._metadata)
        try:
            async for message in call:
                yield message
        except grpc.aio.AioRpcError as error:
            failure = translate(error, subject, self.server, machine=self._member)
            if isinstance(failure, UnreachableError):
                failure = await self._in_words(failure, subject)
            raise failure from None
        finally:
            call.cancel()

    async def watch(self, axes: Iterable[str] = (), period: Seconds = 0.1,
                    fields: Iterable[str] = ()) -> AsyncGenerator[Tick, None]:
        """Latest states at a steady rate; a slow reader misses ticks, never gets old ones. None: all axes. With `fields`
        only those are sent ("position", "fault.message"; names as in types.proto): the others read as if unset."""
        request = axis_service_pb2.WatchAxesRequest(axes=names(axes), period=duration(period),
                                                    fields=FieldMask(paths=names(fields)))
        async with contextlib.aclosing(self._stream(self._axes.WatchAxes, request, "watch")) as stream:
            async for batch in stream:
                yield Tick.of(batch)
