"""A machine and its axes."""
from __future__ import annotations

import asyncio
import contextlib
import datetime
import os
from collections.abc import AsyncGenerator, Iterable
from types import TracebackType
from typing import Any

import grpc
import grpc.aio
from google.protobuf.field_mask_pb2 import FieldMask

from . import tls_trouble
from .address import USUAL_PORT, USUAL_STOP_PORT, with_port
from .audit import AuditRecord
from .axis import Axis
from .budget import BusBudget
from .calls import Seconds, done, duration, names
from .configuration import ConfigCheck, Configuration, Reload
from .drives import Cursor, Device, Event, ScanProgress
from .errors import AxisdError, RefusedError, UnreachableError, translate
from .group import Group
from .holds import Holds
from .kept_state import AllStopped, Conviction, KeptState
from .lease import Lease, LeaseInfo
from .reasons import Reason
from .stop_lane import StopCalls, StopLane, stop_lane_of
from .tls_files import Path, TlsFiles
from .traffic import BusStatistics, FlightRecord, TracedFrame
from .types import AxisState, Bus, Command, Info, Tick
from .v1 import (audit_service_pb2, audit_service_pb2_grpc, axis_service_pb2, axis_service_pb2_grpc, bus_service_pb2,
                 bus_service_pb2_grpc, command_service_pb2, command_service_pb2_grpc, drive_service_pb2_grpc, event_service_pb2, event_service_pb2_grpc,
                 group_service_pb2_grpc, lease_service_pb2, lease_service_pb2_grpc, system_service_pb2,
                 system_service_pb2_grpc, types_pb2)

_OPTIONS = (
    # The daemon permits one ping per second.
    ("grpc.keepalive_time_ms", 2000),
    ("grpc.keepalive_timeout_ms", 1000),
    ("grpc.keepalive_permit_without_calls", 1),
    ("grpc.http2.max_pings_without_data", 0),
    # A machine is on the local network; a proxy of the environment must not redirect its commands.
    ("grpc.enable_http_proxy", 0),
    # A call that failed is reported, never sent again by itself: only stops are, by Machine._stop_call().
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


def connect(server: str | None = None, *, tls_ca: Path | None = None, tls_certificate: Path | None = None,
            tls_key: Path | None = None, timeout: float = 10.0, stop_server: str | None = None,
            speak_for: str | None = None, role: str | None = None) -> Machine:
    """A machine, by HOST, HOST:PORT or unix:PATH, to be used as `async with`. Without a name that of $AXISD_SERVER, else
    localhost; without a port 7443. Connects with the first call. `timeout` limits how long the daemon may take to answer,
    not how long a motion may take. Stops are repeated until then while the daemon cannot be reached. `stop_server`: its
    stop lane; without it that of $AXISD_STOP_SERVER if `server` is not given either, else next to `server`. `tls_ca`: use TLS;
    the daemon's certificate is checked with this PEM file; the others are this client's own. Without them those of
    $AXISD_TLS_CA, $AXISD_TLS_CERT and $AXISD_TLS_KEY. `speak_for`: of a delegate: the person whom all calls are made for;
    `role`: what they may do ("viewer", "operator", "maintainer"), at most what the delegate may. Raises ArgumentError."""
    if server is None:
        server = os.environ.get("AXISD_SERVER") or "localhost"
        # Never beside a server that was named: another machine's lane would stop another machine's axis.
        if stop_server is None:
            stop_server = os.environ.get("AXISD_STOP_SERVER")
    return Machine(with_port(server, USUAL_PORT), TlsFiles.given(tls_ca, tls_certificate, tls_key), timeout,
                   with_port(stop_server, USUAL_STOP_PORT) if stop_server else None, speak_for, role)


class Machine:
    """One daemon. Made by connect()."""

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

    async def __aenter__(self) -> Machine:
        ordinary, stops = (channel_to(self.server, self._credentials) for _ in range(2))
        address = self.stop_server or stop_lane_of(self.server)
        lane = channel_to(address, self._credentials) if address is not None else None
        self._channels = [channel for channel in (ordinary, stops, lane) if channel is not None]
        self._use(ordinary, stops, lane)
        return self

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

    async def __aexit__(self, kind: type[BaseException] | None, error: BaseException | None,
                        traceback: TracebackType | None) -> None:
        for channel in self._channels:
            await channel.close()

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

    def axis(self, name: str) -> Axis:
        """An axis by its name. Asks nothing: an unknown name shows with the first call."""
        return Axis(self, name)

    def group(self, name: str = "", *, axes: Iterable[str] = (), lease: Lease | None = None) -> Group:
        """Axes that start and stop together: a group of the configuration by its name, or these axes. As an `async with`
        block it stops them when the block ends by an error. `lease`: that its moves are given under."""
        return Group(self, name, tuple(names(axes)), lease.token if lease is not None else 0)

    def lease(self, *axes: str, ttl: Seconds | None = None, label: str = "", take: bool = False) -> Lease:
        """The exclusive right to command these axes (or all axes of the groups named) inside an `async with` block,
        renewed as long as it runs. `ttl`: seconds from each renewal (default: the daemon's). `take`: also from
        others."""
        return Lease(self, axes, ttl, label, take)

    async def leases(self) -> list[LeaseInfo]:
        """Who leases what, oldest first."""
        response = await self._call(self._leases.ListLeases, lease_service_pb2.ListLeasesRequest(), "")
        return [LeaseInfo.of(lease) for lease in response.leases]

    async def axes(self) -> dict[str, AxisState]:
        """All axes with their states."""
        response = await self._call(self._axes.ListAxes, axis_service_pb2.ListAxesRequest(), "")
        return {state.axis: AxisState.of(state) for state in response.axes}

    async def watch(self, axes: Iterable[str] = (), period: Seconds = 0.1,
                    fields: Iterable[str] = ()) -> AsyncGenerator[Tick, None]:
        """Latest states at a steady rate; a slow reader misses ticks, never gets old ones. None: all axes. With `fields`
        only those are sent ("position", "fault.message"; names as in types.proto): the others read as if unset."""
        request = axis_service_pb2.WatchAxesRequest(axes=names(axes), period=duration(period),
                                                    fields=FieldMask(paths=names(fields)))
        async with contextlib.aclosing(self._stream(self._axes.WatchAxes, request, "watch")) as stream:
            async for batch in stream:
                yield Tick.of(batch)

    async def command(self, command_id: str) -> Command:
        """How a command stands."""
        request = command_service_pb2.GetCommandRequest(id=command_id)
        return Command.of((await self._call(self._commands.GetCommand, request, command_id)).command)

    async def watch_command(self, command_id: str) -> AsyncGenerator[Command, None]:
        """A command now and at each change, until it has ended."""
        request = command_service_pb2.WatchCommandRequest(id=command_id)
        async with contextlib.aclosing(self._stream(self._commands.WatchCommand, request, command_id)) as stream:
            async for change in stream:
                yield Command.of(change.command)

    async def wait(self, command: Command) -> Command:
        """Waits until a command that was started with wait=False has ended. Raises MotionError unless Done."""
        async with contextlib.aclosing(self.watch_command(command.id)) as changes:
            async for latest in changes:
                if latest.state.ended:
                    return done(latest, self._member or "")
        raise AxisdError(f"{command.axis}: the daemon ended the stream before command {command.id} had ended")

    async def cancel(self, command_id: str) -> Command:
        """Halts the axis if it executes this command."""
        request = command_service_pb2.CancelCommandRequest(id=command_id)
        return Command.of((await self._stop_call(self._stops.CancelCommand, request, command_id)).command)

    async def commands(self, axis: str = "", limit: int = 20) -> list[Command]:
        """The newest commands of all clients since the daemon was started, newest first; of one axis unless that is empty."""
        request = command_service_pb2.ListCommandsRequest(axis=axis, limit=limit)
        return [Command.of(raw) for raw in (await self._call(self._commands.ListCommands, request, axis)).commands]

    async def stop_all(self, *, wait: bool = True) -> AllStopped:
        """Stops every axis and refuses all motion until release_stop_all(). An operational stop, without safety
        rating. Never raises for a single axis: look at each result, and at `not_durable`."""
        request = system_service_pb2.StopAllRequest(
            wait_until=types_pb2.WAIT_UNTIL_DONE if wait else types_pb2.WAIT_UNTIL_ACCEPTED)
        response = await self._stop_call(self._stops.StopAll, request, "stop all", wait)
        return AllStopped.of(response)

    async def release_stop_all(self) -> None:
        """Permits motion again; nothing moves by itself."""
        await self._call(self._system.ReleaseStopAll, system_service_pb2.ReleaseStopAllRequest(), "release stop all")

    async def buses(self) -> list[Bus]:
        response = await self._call(self._buses.ListBuses, bus_service_pb2.ListBusesRequest(), "")
        return [Bus.of(bus) for bus in response.buses]

    async def budgets(self) -> list[BusBudget]:
        """What each bus can promise, and the longest times that were seen."""
        response = await self._call(self._buses.GetBudget, bus_service_pb2.GetBudgetRequest(), "")
        return [BusBudget.of(budget) for budget in response.budgets]

    async def scan(self, bus: str, *, first_node: int = 1, last_node: int = 127, bauds: Iterable[int] = (),
                   formats: Iterable[str] = (),
                   reply_timeout: Seconds | None = None) -> AsyncGenerator[ScanProgress, None]:
        """Looks for nodes; leaving the loop ends it. Other rates and formats than the bus's own are refused while any of
        its axes is enabled."""
        request = bus_service_pb2.ScanRequest(bus=bus, first_node=first_node, last_node=last_node, bauds=list(bauds),
                                              formats=list(formats), reply_timeout=duration(reply_timeout))
        async with contextlib.aclosing(self._stream(self._buses.Scan, request, bus)) as stream:
            async for progress in stream:
                yield ScanProgress.of(progress)

    async def read_registers(self, bus: str, node: int, address: int, count: int = 1) -> list[int]:
        """Reads holding registers of any node, through the bus's queue."""
        request = bus_service_pb2.TransactRequest(bus=bus, node=node, address=address, read=count)
        return list((await self._call(self._buses.Transact, request, bus)).values)

    async def write_registers(self, bus: str, node: int, address: int, values: Iterable[int]) -> None:
        """Writes holding registers of a node that no axis owns."""
        request = bus_service_pb2.TransactRequest(bus=bus, node=node, address=address,
                                                  write=bus_service_pb2.RegisterValues(values=list(values)))
        await self._call(self._buses.Transact, request, bus)

    async def read_object(self, bus: str, node: int, index: int, sub: int = 0) -> bytes:
        """Reads an object of any node of a CAN network, low byte first (4 bytes if the node does not say how many)."""
        read = bus_service_pb2.ObjectRead()
        request = bus_service_pb2.TransactRequest(bus=bus, node=node, address=index << 8 | sub, read_object=read)
        return (await self._call(self._buses.Transact, request, bus)).data

    async def write_object(self, bus: str, node: int, index: int, sub: int, data: bytes) -> None:
        """Writes an object of a node that no axis owns; `data` has the object's size, low byte first."""
        write = bus_service_pb2.ObjectWrite(data=data)
        request = bus_service_pb2.TransactRequest(bus=bus, node=node, address=index << 8 | sub, write_object=write)
        await self._call(self._buses.Transact, request, bus)

    async def bus_statistics(self, bus: str = "") -> dict[str, BusStatistics]:
        """How much a bus (or each) was used, how long exchanges took, and what went wrong."""
        request = bus_service_pb2.GetBusStatisticsRequest(bus=bus)
        response = await self._call(self._buses.GetBusStatistics, request, bus)
        return {one.bus: BusStatistics.of(one) for one in response.buses}

    async def watch_bus_statistics(self, bus: str = "", *,
                                   period: Seconds = 1.0) -> AsyncGenerator[dict[str, BusStatistics], None]:
        """The same again and again, every 0.1 to 60 s; a slow reader misses some, and never gets old ones."""
        request = bus_service_pb2.WatchBusStatisticsRequest(bus=bus, period=duration(period))
        async with contextlib.aclosing(self._stream(self._buses.WatchBusStatistics, request, bus)) as stream:
            async for tick in stream:
                yield {one.bus: BusStatistics.of(one) for one in tick.buses}

    async def trace(self, bus: str, *, node: int | None = None) -> AsyncGenerator[TracedFrame, None]:
        """The frames of a bus from now on, without end, and what was not sent."""
        request = bus_service_pb2.TraceBusRequest(bus=bus, node=node)
        async with contextlib.aclosing(self._stream(self._buses.TraceBus, request, bus)) as stream:
            lost = 0
            async for batch in stream:
                lost += batch.lost
                for frame in batch.frames:
                    yield TracedFrame.of(frame, lost)
                    lost = 0

    async def flight_records(self) -> list[FlightRecord]:
        """What was recorded after faults, oldest first."""
        response = await self._call(self._buses.ListFlightRecords, bus_service_pb2.ListFlightRecordsRequest(), "")
        return [FlightRecord.of(record) for record in response.records]

    async def flight_record(self, name: str) -> str:
        """The text of one."""
        request = bus_service_pb2.GetFlightRecordRequest(name=name)
        return (await self._call(self._buses.GetFlightRecord, request, name)).text

    async def write_flight_record(self, bus: str) -> str:
        """Writes one now; returns its name."""
        request = bus_service_pb2.WriteFlightRecordRequest(bus=bus)
        return (await self._call(self._buses.WriteFlightRecord, request, bus)).name

    async def devices(self) -> dict[str, Device]:
        """The nodes that are not axes, as they were last read."""
        response = await self._call(self._buses.ListDevices, bus_service_pb2.ListDevicesRequest(), "")
        return {device.name: Device.of(device) for device in response.devices}

    async def write_device(self, device: str, register: str, value: float) -> float:
        """Writes one named register or object; returns the value as written."""
        request = bus_service_pb2.WriteDeviceRequest(device=device, register=register, value=value)
        return (await self._call(self._buses.WriteDevice, request, device)).value

    async def events(self, axes: Iterable[str] = (), *, after: Cursor | None = None,
                     kept: bool = False) -> AsyncGenerator[Event, None]:
        """What happens from now on, in order and without end. `after`: the cursor of the last event that was seen, to go
        on there, also after a lost connection. `kept`: first everything that the daemon still keeps."""
        request = event_service_pb2.WatchEventsRequest(axes=names(axes))
        if after is not None:
            request.instance_id, request.after_sequence = after.instance_id, after.sequence
        elif kept:
            request.after_sequence = 0
        async with contextlib.aclosing(self._stream(self._events.WatchEvents, request, "events")) as stream:
            lost = 0
            async for batch in stream:
                lost += batch.lost
                for event in batch.events:
                    yield Event.of(event, batch.instance_id, lost)
                    lost = 0

    async def audit(self, axes: Iterable[str] = (), *, clients: Iterable[str] = (), kinds: Iterable[str] = (),
                    since: datetime.datetime | None = None, after: int = 0) -> AsyncGenerator[AuditRecord, None]:
        """What is kept of who asked for what, over restarts of the daemon, up to the newest record; oldest first. `kinds`:
        as AuditRecord.kind. `since`: a time with its zone. `after`: number of the last record that was seen, to go on."""
        request = audit_service_pb2.ListAuditRequest(
            axes=names(axes), clients=names(clients), after_number=after, limit=500,
            kinds=[audit_service_pb2.AuditKind.Value(f"AUDIT_KIND_{kind.upper()}") for kind in kinds])
        if since is not None:
            request.since.FromDatetime(since)
        while True:
            page = await self._call(self._audit.ListAudit, request, "audit")
            for record in page.records:
                yield AuditRecord.of(record)
            request.after_number = page.cursor
            if page.cursor >= page.newest:
                return

    async def info(self) -> Info:
        return Info.of(await self._call(self._system.GetInfo, system_service_pb2.GetInfoRequest(), ""))

    async def state(self) -> KeptState:
        """What the daemon remembers over restarts, and whether that is certain."""
        return KeptState.of(await self._call(self._system.GetState, system_service_pb2.GetStateRequest(), "state"))

    async def accept_state(self) -> list[Conviction]:
        """Takes what the daemon remembers as it is: motion waits no longer. Look at the machine first. Returns what was
        accepted."""
        response = await self._call(self._system.AcceptState, system_service_pb2.AcceptStateRequest(), "accept state")
        return [Conviction.of(conviction) for conviction in response.accepted]

    async def log_level(self, level: str | None = None) -> str:
        """How much the daemon writes into its log: "trace", "debug", "info", "warn" or "error". With `level` it does so from
        now until it ends. Returns what it was before."""
        request = system_service_pb2.SetLogLevelRequest()
        if level is not None:
            request.level = system_service_pb2.LogLevel.Value(f"LOG_LEVEL_{level.upper()}")
        response = await self._call(self._system.SetLogLevel, request, "set log level")
        return system_service_pb2.LogLevel.Name(response.previous).removeprefix("LOG_LEVEL_").lower()

    async def configuration(self) -> Configuration:
        """What is served: the daemon's file as it was at its start or at the last reload."""
        return Configuration.of(await self._call(self._system.GetConfig, system_service_pb2.GetConfigRequest(), ""))

    async def check_configuration(self, yaml: str) -> ConfigCheck:
        """What the daemon would say to this text. Changes nothing."""
        request = system_service_pb2.CheckConfigRequest(yaml=yaml)
        return ConfigCheck.of(await self._call(self._system.CheckConfig, request, "check configuration"))

    async def reload_configuration(self, dry_run: bool = False) -> Reload:
        """Serves what the daemon's file says now: all of it or nothing, and only what changed is touched. What stands
        against it is in the answer. An axis that changes comes up as after a start of the daemon."""
        request = system_service_pb2.ReloadConfigRequest(dry_run=dry_run)
        return Reload.of(await self._call(self._system.ReloadConfig, request, "reload configuration"))
