"""A machine and its axes."""
from __future__ import annotations

import contextlib
import datetime
import os
from collections.abc import AsyncGenerator, Iterable
from types import TracebackType

from .address import USUAL_PORT, USUAL_STOP_PORT, with_port
from .audit import AuditRecord
from .axis import Axis
from .budget import BusBudget
from .calls import Seconds, done, duration, names
from .configuration import ConfigCheck, Configuration, Reload
from .connection import Connection, channel_to
from .drives import Cursor, Device, Event, ScanProgress
from .errors import AxisdError
from .group import Group
from .kept_state import AllStopped, Conviction, KeptState
from .lease import Lease, LeaseInfo
from .stop_lane import stop_lane_of
from .tls_files import Path, TlsFiles
from .traffic import BusStatistics, FlightRecord, TracedFrame
from .types import AxisState, Bus, Command, Info
from .v1 import (audit_service_pb2, axis_service_pb2, bus_service_pb2, command_service_pb2, event_service_pb2,
                 lease_service_pb2, system_service_pb2, types_pb2)


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


class Machine(Connection):
    """One daemon. Made by connect()."""

    async def __aenter__(self) -> Machine:
        ordinary, stops = (channel_to(self.server, self._credentials) for _ in range(2))
        address = self.stop_server or stop_lane_of(self.server)
        lane = channel_to(address, self._credentials) if address is not None else None
        self._channels = [channel for channel in (ordinary, stops, lane) if channel is not None]
        self._use(ordinary, stops, lane)
        return self

    async def __aexit__(self, kind: type[BaseException] | None, error: BaseException | None,
                        traceback: TracebackType | None) -> None:
        for channel in self._channels:
            await channel.close()

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
