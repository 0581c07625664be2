"""The exclusive right to command axes, renewed while a block runs."""
from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import datetime
import uuid
from types import TracebackType
from typing import TYPE_CHECKING, Any

from .axis import Axis
from .calls import Seconds, duration
from .errors import AxisdError, LeaseLostError, RefusedError, UnreachableError
from .v1 import lease_service_pb2

if TYPE_CHECKING:
    from .machine import Machine


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


class Lease:
    """Leases axes inside an `async with` block; made by Machine.lease(). The axes of lease.axis() carry its token. If
    the lease is lost, the block is cancelled and LeaseLostError raised at its end. If this program dies or its event
    loop hangs, the lease ends by itself and moving axes do what their `on_lease_loss` says."""

    def __init__(self, machine: Machine, axes: tuple[str, ...], ttl: Seconds | None, label: str, take: bool) -> None:
        self._machine = machine
        self._request = lease_service_pb2.AcquireLeaseRequest(axes=axes, ttl=duration(ttl), label=label, take=take,
                                                              request_id=str(uuid.uuid4()))
        self._block: asyncio.Task[Any] | None = None
        self._renewal: asyncio.Task[None] | None = None
        self._lost: AxisdError | None = None
        self.token = 0
        self.info: LeaseInfo | None = None
        self.taken: tuple[LeaseInfo, ...] = ()

    def axis(self, name: str) -> Axis:
        """An axis whose commands are given under this lease."""
        return Axis(self._machine, name, self.token)

    async def __aenter__(self) -> Lease:
        subject = ", ".join(self._request.axes)
        asked = asyncio.get_running_loop().time()
        response = await self._machine._call(self._machine._leases.AcquireLease, self._request, subject)
        self.token = response.lease_token
        self.info = LeaseInfo.of(response.lease)
        self.taken = tuple(LeaseInfo.of(lease) for lease in response.taken)
        self._block = asyncio.current_task()
        self._renewal = asyncio.create_task(self._renew(asked + self.info.ttl, self.info.ttl))
        return self

    async def __aexit__(self, kind: type[BaseException] | None, error: BaseException | None,
                        traceback: TracebackType | None) -> None:
        assert self._renewal is not None and self._block is not None
        self._renewal.cancel()
        await asyncio.gather(self._renewal, return_exceptions=True)
        if self._lost is None:
            with contextlib.suppress(AxisdError):  # it ends by itself otherwise
                request = lease_service_pb2.ReleaseLeaseRequest(lease_token=self.token)
                await self._machine._call(self._machine._leases.ReleaseLease, request, "")
            return
        # The cancellation was ours: nobody else's is swallowed, as in asyncio.timeout().
        cancelled_by_others = self._block.uncancel() > 0
        if error is None or isinstance(error, AxisdError) or (kind is asyncio.CancelledError
                                                              and not cancelled_by_others):
            raise LeaseLostError(str(self._lost)) from error

    async def _renew(self, expires: float, ttl: float) -> None:
        """Ends the block when the lease is lost; whatever ends the renewals loses it."""
        try:
            self._lost = await self._renew_until_lost(expires, ttl)
        except Exception as error:
            self._lost = LeaseLostError(f"the lease was not renewed: {error}")
        assert self._block is not None
        self._block.cancel()

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
