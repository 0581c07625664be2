"""The exclusive right to command axes, renewed while a block runs."""
from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import datetime
import uuid
from collections.abc import Callable
from types import TracebackType
from typing import Any

from .axis import Axis
from .calls import Seconds, duration
from .connection import Connection
from .errors import AxisdError, LeaseLostError, RefusedError, UnreachableError
from .v1 import lease_service_pb2


@dataclasses.dataclass(frozen=True)
class LeaseInfo:
    """Who may command which axes, and how long still unless the lease is renewed (s)."""
    client: str
    label: str
    axes: tuple[str, ...]
    ttl: float
    remaining: float
    acquired_at: datetime.datetime

    @classmethod
    def of(cls, raw: lease_service_pb2.Lease) -> LeaseInfo:
        return cls(raw.client, raw.label, tuple(raw.axes), raw.ttl.ToTimedelta().total_seconds(),
                   raw.remaining.ToTimedelta().total_seconds(), raw.acquired_at.ToDatetime(datetime.timezone.utc))


class OwnedLease:
    """The lease of one machine: renewed by a task of its own from its acquisition on, until it is released or lost.
    `lost` is told why, once."""

    def __init__(self, machine: Connection, axes: tuple[str, ...], ttl: Seconds | None, label: str, take: bool,
                 lost: Callable[[AxisdError], None]) -> None:
        self._machine = machine
        self._request = lease_service_pb2.AcquireLeaseRequest(axes=axes, ttl=duration(ttl), label=label, take=take,
                                                              request_id=str(uuid.uuid4()))
        self._tell = lost
        self._renewal: asyncio.Task[None] | None = None
        self._lost = False
        self.token = 0
        self.info: LeaseInfo | None = None
        self.taken: tuple[LeaseInfo, ...] = ()

    def axis(self, name: str) -> Axis:
        return Axis(self._machine, name, self.token)

    async def acquire(self) -> None:
        subject = ", ".join(self._request.axes)
        asked = asyncio.get_running_loop().time()
        response = await self._machine._call(self._machine._leases.AcquireLease, self._request, subject)
        self.token = response.lease_token
        self.info = LeaseInfo.of(response.lease)
        self.taken = tuple(LeaseInfo.of(lease) for lease in response.taken)
        self._renewal = asyncio.create_task(self._renew(asked + self.info.ttl, self.info.ttl))

    async def release(self) -> None:
        """Nothing where it was never acquired, or lost."""
        if self._renewal is None:
            return
        self._renewal.cancel()
        await asyncio.gather(self._renewal, return_exceptions=True)
        if self._lost:
            return
        with contextlib.suppress(AxisdError):  # it ends by itself otherwise
            request = lease_service_pb2.ReleaseLeaseRequest(lease_token=self.token)
            await self._machine._call(self._machine._leases.ReleaseLease, request, "")

    async def _renew(self, expires: float, ttl: float) -> None:
        """Whatever ends the renewals loses the lease."""
        try:
            why = await self._renew_until_lost(expires, ttl)
        except Exception as error:
            why = LeaseLostError(f"the lease was not renewed: {error}")
        self._lost = True
        self._tell(why)

    async def _renew_until_lost(self, expires: float, ttl: float) -> AxisdError:
        # Three renewals per time to live: two may be late or lost.
        loop = asyncio.get_running_loop()
        request = lease_service_pb2.RenewLeaseRequest(lease_token=self.token)
        failure: AxisdError | None = None
        while loop.time() < expires:
            await asyncio.sleep(min(ttl / 3, max(expires - loop.time(), 0)))
            asked = loop.time()
            try:
                await self._machine._attempt(self._machine._stops.RenewLease, request, "", wait=False,
                                             limit=min(self._machine.timeout, ttl / 3))
                expires = asked + ttl
            except UnreachableError as unreachable:
                failure = unreachable
            except RefusedError as refused:
                return refused
        return failure or LeaseLostError("the lease was not renewed in time: this program was held up")


class LeasedBlock:
    """An `async with` block that is cancelled when a lease is lost; LeaseLostError is raised at its end."""

    def __init__(self) -> None:
        self._block: asyncio.Task[Any] | None = None
        self._why: AxisdError | None = None

    def _begin(self) -> None:
        self._block = asyncio.current_task()

    def _lose(self, why: AxisdError) -> None:
        if self._why is not None:
            return  # the block is being cancelled already
        self._why = why
        assert self._block is not None
        self._block.cancel()

    def _end(self, error: BaseException | None) -> None:
        """Raises LeaseLostError, unless no lease was lost, or the block ended by something that is not of this
        package."""
        if self._why is None:
            return
        assert self._block is not None
        # The cancellation was ours: nobody else's is swallowed, as in asyncio.timeout().
        cancelled_by_others = self._block.uncancel() > 0
        if error is None or isinstance(error, AxisdError) or (isinstance(error, asyncio.CancelledError)
                                                              and not cancelled_by_others):
            raise LeaseLostError(str(self._why)) from error


class Lease(LeasedBlock):
    """Leases axes inside an `async with` block; made by Machine.lease(). The axes of lease.axis() carry its token. If
    the lease is lost, the block is cancelled and LeaseLostError raised at its end. If this program dies or its event
    loop hangs, the lease ends by itself and moving axes do what their `on_lease_loss` says."""

    def __init__(self, machine: Connection, axes: tuple[str, ...], ttl: Seconds | None, label: str, take: bool) -> None:
        super().__init__()
        self._lease = OwnedLease(machine, axes, ttl, label, take, self._lose)

    @property
    def token(self) -> int:
        """What commands carry; 0 before the block."""
        return self._lease.token

    @property
    def info(self) -> LeaseInfo | None:
        """None before the block."""
        return self._lease.info

    @property
    def taken(self) -> tuple[LeaseInfo, ...]:
        """Of others, that ended for this one."""
        return self._lease.taken

    def axis(self, name: str) -> Axis:
        """An axis whose commands are given under this lease."""
        return self._lease.axis(name)

    async def __aenter__(self) -> Lease:
        self._begin()
        await self._lease.acquire()
        return self

    async def __aexit__(self, kind: type[BaseException] | None, error: BaseException | None,
                        traceback: TracebackType | None) -> None:
        await self._lease.release()
        self._end(error)
