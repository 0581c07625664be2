"""A cell: several machines, reached through the entrance of any of them."""
from __future__ import annotations

import contextlib
import os
from collections.abc import AsyncGenerator, Mapping
from types import TracebackType

import grpc.aio

from .address import USUAL_CELL_PORT, with_port
from .axis import Axis
from .calls import Seconds
from .cell.v1 import cell_service_pb2, cell_service_pb2_grpc
from .cell_group import CellMove, request_of
from .cell_lease import CellLease, split
from .cell_types import CellEvent, CellInfo, CellMachine, CellReleased, CellStopped
from .connection import channel_to
from .drives import Cursor
from .machine import Machine
from .tls_files import Path, TlsFiles


def connect_cell(entrance: str | None = None, *, tls_ca: Path | None = None, tls_certificate: Path | None = None,
                 tls_key: Path | None = None, timeout: float = 10.0) -> Cell:
    """A cell, by HOST:PORT of the entrance of any of its machines (without a port 7445), to be used as `async with`. Without
    a name that of $AXISD_CELL, else localhost. Connects with the first call. `timeout` and the TLS files as of
    connect()."""
    if entrance is None:
        entrance = os.environ.get("AXISD_CELL") or "localhost"
    return Cell(with_port(entrance, USUAL_CELL_PORT), TlsFiles.given(tls_ca, tls_certificate, tls_key), timeout)


class MemberMachine(Machine):
    """A machine of a cell, made by Cell.machine(): as one that was connected to, but its calls go through the entrance, and
    errors have its name in front. It is open as long as the cell is."""

    def __init__(self, cell: Cell, name: str, ordinary: grpc.aio.Channel, stops: grpc.aio.Channel) -> None:
        super().__init__(cell.server, cell._entrance._tls, cell.timeout)
        self.name = name
        self._member = name
        self._metadata = (("axisd-machine", name),)
        self._use(ordinary, stops, stops)  # the entrance passes StopService on to the machine's stop lane

    async def __aenter__(self) -> Machine:
        return self

    async def __aexit__(self, kind: type[BaseException] | None, error: BaseException | None,
                        traceback: TracebackType | None) -> None:
        pass


class Cell:
    """The machines of a cell, through one entrance. Made by connect_cell()."""

    def __init__(self, server: str, tls: TlsFiles, timeout: float) -> None:
        self.server = server
        self.timeout = timeout
        # How it is called, and what its errors say, is that of a machine.
        self._entrance = Machine(server, tls, timeout)
        self._entrance._member = ""
        self._channels: tuple[grpc.aio.Channel, grpc.aio.Channel] | None = None
        self._machines: dict[str, MemberMachine] = {}

    async def __aenter__(self) -> Cell:
        credentials = self._entrance._credentials
        self._channels = channel_to(self.server, credentials), channel_to(self.server, credentials)
        ordinary, stops = self._channels
        self._cell = cell_service_pb2_grpc.CellServiceStub(ordinary)
        self._stops = cell_service_pb2_grpc.CellServiceStub(stops)
        return self

    async def __aexit__(self, kind: type[BaseException] | None, error: BaseException | None,
                        traceback: TracebackType | None) -> None:
        for channel in self._channels or ():
            await channel.close()
        self._machines.clear()

    def machine(self, name: str) -> MemberMachine:
        """One machine by its name. Asks nothing: an unknown name shows with the first call."""
        if self._channels is None:
            raise RuntimeError("use the cell as 'async with'")
        if name not in self._machines:
            self._machines[name] = MemberMachine(self, name, *self._channels)
        return self._machines[name]

    def axis(self, name: str) -> Axis:
        """An axis by its machine's name and its own: "press-2/feeder"."""
        machine, axis = split(name)
        return self.machine(machine).axis(axis)

    def lease(self, *axes: str, ttl: Seconds | None = None, label: str = "", take: bool = False) -> CellLease:
        """The exclusive right to command these axes inside an `async with` block: cell.lease("press-1/feeder",
        "press-2/arm"). `ttl` and `take` as of Machine.lease()."""
        return CellLease(self.machine, axes, ttl, label, take)

    async def move(self, targets: Mapping[str, float], *, relative: bool = False,
                   velocity: Mapping[str, float] | None = None, acceleration_time: Seconds | None = None,
                   deceleration_time: Seconds | None = None, clock_tolerance: Seconds | None = None,
                   lease: CellLease | None = None, wait: bool = True, request_id: str | None = None) -> CellMove:
        """Moves axes of several machines from one moment on, to positions (or by distances) by their names:
        {"press-1/feeder": 100, "press-2/arm": 90}. What forbids one to start forbids it to all. Whatever fails at one stops
        the others, some 0.2 s later; where a machine does not answer, 0.65 s later. Where the entrance is gone, each
        machine begins to stop its axes after half a second. Waits until all have ended, unless `wait` is False. `lease`:
        the one under which it moves. `clock_tolerance`: refused where a machine's clock is known less well (1 ms).
        Raises as Group.move(); where the entrance is shut down meanwhile, UnreachableError: repeat it with the same
        `request_id` through another one."""
        request = request_of(targets, relative, velocity or {}, acceleration_time, deceleration_time, clock_tolerance,
                             lease, wait, request_id)
        response = await self._entrance._call(self._cell.MoveGroup, request, ", ".join(sorted(targets)), wait)
        move = CellMove.of(response.move)
        if (failure := move.failure()) is not None:
            raise failure
        return move

    async def info(self) -> CellInfo:
        """The cell, its registry, what stands of StopAll, and who is asking."""
        return CellInfo.of(await self._entrance._call(self._cell.GetCell, cell_service_pb2.GetCellRequest(), ""))

    async def machines(self) -> dict[str, CellMachine]:
        """All machines that the entrance knows, by name."""
        request = cell_service_pb2.ListMachinesRequest()
        response = await self._entrance._call(self._cell.ListMachines, request, "")
        return {machine.name: CellMachine.of(machine) for machine in response.machines}

    async def watch_machines(self) -> AsyncGenerator[dict[str, CellMachine], None]:
        """All machines, now and at each change of one. A slow reader gets the newest."""
        request = cell_service_pb2.WatchMachinesRequest()
        known: dict[str, CellMachine] = {}
        async with contextlib.aclosing(self._entrance._stream(self._cell.WatchMachines, request, "")) as stream:
            async for change in stream:
                known |= {machine.name: CellMachine.of(machine) for machine in change.machines}
                for name in change.forgotten:
                    known.pop(name, None)
                yield dict(sorted(known.items()))

    async def stop_all(self, reason: str = "") -> CellStopped:
        """Stops every axis of every machine and refuses all motion until release_stop_all(); a machine that comes back is
        told again. Answers within about a second. An operational stop, without safety rating. Never raises for a single
        machine: look at `failed`. Repeated, as every stop, while the entrance cannot be reached; another entrance of the
        cell does as well."""
        request = cell_service_pb2.StopAllRequest(reason=reason)
        return CellStopped.of(await self._entrance._stop_call(self._stops.StopAll, request, "stop all"))

    async def release_stop_all(self) -> CellReleased:
        """Permits motion again, in the cell and at each machine that answers; nothing moves by itself. Never raises for a
        single machine: look at `failed`."""
        request = cell_service_pb2.ReleaseStopAllRequest()
        return CellReleased.of(await self._entrance._call(self._cell.ReleaseStopAll, request, "release stop all"))

    async def events(self, *, after: Cursor | None = None, kept: bool = False) -> AsyncGenerator[CellEvent, None]:
        """What this entrance sees of the cell from now on, in order and without end: machines that come and go, the registry,
        StopAll. Events of axes are those of each Machine. `after` and `kept` as of Machine.events()."""
        request = cell_service_pb2.WatchEventsRequest()
        if after is not None:
            request.instance_id, request.after_sequence = after.instance_id, after.sequence
        elif kept:
            request.after_sequence = 0
        async with contextlib.aclosing(self._entrance._stream(self._cell.WatchEvents, request, "")) as stream:
            lost = 0
            async for batch in stream:
                lost += batch.lost
                for event in batch.events:
                    yield CellEvent.of(event, batch.instance_id, lost)
                    lost = 0
