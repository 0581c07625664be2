"""The exclusive right to command axes of several machines of a cell."""
from __future__ import annotations

import asyncio
from collections.abc import Callable
from types import TracebackType

from .axis import Axis
from .calls import Seconds
from .connection import Connection
from .errors import ArgumentError
from .lease import LeasedBlock, LeaseInfo, OwnedLease


class CellLease(LeasedBlock):
    """Leases axes of several machines inside an `async with` block; made by Cell.lease(). One lease per machine, with a
    token of that machine's own: whoever owns an axis decides about it. They are taken in the order of the machines' names,
    all or none, and each is renewed to its owner. If one is lost, the block is cancelled, the others are given back, and
    LeaseLostError is raised at its end. A machine that cannot be reached any more ends its own lease after its time to
    live; its axes then do what their `on_lease_loss` says."""

    def __init__(self, connection_to: Callable[[str], Connection], axes: tuple[str, ...], ttl: Seconds | None, label: str,
                 take: bool) -> None:
        super().__init__()
        wanted: dict[str, list[str]] = {}
        for name in axes:
            machine, axis = split(name)
            wanted.setdefault(machine, []).append(axis)
        if not wanted:
            raise ArgumentError("a lease needs axes", "name them: cell.lease('press-1/feeder', ...)")
        self._leases = {machine: OwnedLease(connection_to(machine), tuple(wanted[machine]), ttl, label, take, self._lose)
                        for machine in sorted(wanted)}

    @property
    def tokens(self) -> dict[str, int]:
        """What commands carry, by machine; 0 before the block."""
        return {machine: lease.token for machine, lease in self._leases.items()}

    @property
    def infos(self) -> dict[str, LeaseInfo]:
        """The leases by machine; none before the block."""
        return {machine: lease.info for machine, lease in self._leases.items() if lease.info is not None}

    @property
    def taken(self) -> dict[str, tuple[LeaseInfo, ...]]:
        """Leases of others, by machine, that ended for these."""
        return {machine: lease.taken for machine, lease in self._leases.items()}

    def axis(self, name: str) -> Axis:
        """An axis whose commands are given under its machine's lease."""
        machine, axis = split(name)
        if machine not in self._leases:
            raise ArgumentError(f"{name}: nothing of {machine} is leased here", "lease it as well")
        return self._leases[machine].axis(axis)

    async def __aenter__(self) -> CellLease:
        self._begin()
        try:
            for lease in self._leases.values():
                await lease.acquire()
        except BaseException as error:
            await self._give_back()
            self._end(error)  # one that was taken already may have been lost meanwhile
            raise
        return self

    async def __aexit__(self, kind: type[BaseException] | None, error: BaseException | None,
                        traceback: TracebackType | None) -> None:
        await self._give_back()
        self._end(error)

    async def _give_back(self) -> None:
        await asyncio.gather(*(lease.release() for lease in self._leases.values()))


def split(name: str) -> tuple[str, str]:
    """"press-2/feeder": the machine, and its axis."""
    machine, slash, axis = name.partition("/")
    if not machine or not slash or not axis:
        raise ArgumentError(f"{name!r} is no axis of a cell", "write MACHINE/AXIS, such as 'press-2/feeder'")
    return machine, axis
