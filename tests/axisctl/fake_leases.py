"""The leases of the fake daemon: one holder per axis, in real time."""
import asyncio
import time

import grpc

from fake_axis import refuse
from axisd.v1 import error_pb2, lease_service_pb2 as pb, lease_service_pb2_grpc as rpc

SERVICES = (rpc.add_LeaseServiceServicer_to_server,)


class FakeLeases(rpc.LeaseServiceServicer):
    """`leases`: lease and end by token. `lose(token)` ends one early, as if somebody had taken it."""

    def __init__(self):
        self.leases = {}
        self.last_token = 100

    def lose(self, token):
        self.leases.pop(token, None)

    def lease_of(self, token):
        lease, ends = self.leases[token]
        lease.remaining.FromNanoseconds(max(0, round((ends - time.monotonic()) * 1e9)))
        return lease

    async def AcquireLease(self, request, context):
        self.note("AcquireLease", request, context)
        taken = [token for token, (lease, ends) in self.leases.items()
                 if set(lease.axes) & set(request.axes) and ends > time.monotonic()]
        if taken and not request.take:
            await refuse(context, grpc.StatusCode.PERMISSION_DENIED, error_pb2.ErrorDetail(
                reason=error_pb2.REASON_LEASE_REQUIRED, message=f"{request.axes[0]}: leased by test for another 1.0 s",
                remedy="ask its holder"))
        lost = [self.leases.pop(token)[0] for token in taken]
        self.last_token += 1
        lease = pb.Lease(client="test", label=request.label, axes=request.axes)
        lease.ttl.FromNanoseconds(request.ttl.ToNanoseconds() or 2_000_000_000)
        self.leases[self.last_token] = (lease, time.monotonic() + lease.ttl.ToNanoseconds() / 1e9)
        return pb.AcquireLeaseResponse(lease=self.lease_of(self.last_token), lease_token=self.last_token, taken=lost)

    async def known_lease(self, request, context):
        lease, ends = self.leases.get(request.lease_token, (None, 0))
        if ends <= time.monotonic():
            await refuse(context, grpc.StatusCode.ABORTED, error_pb2.ErrorDetail(
                reason=error_pb2.REASON_LEASE_LOST, message="other took the lease 0.1 s ago",
                remedy="acquire a lease again"))
        return lease

    async def RenewLease(self, request, context):
        self.note("RenewLease", request, context)
        lease = await self.known_lease(request, context)
        self.leases[request.lease_token] = (lease, time.monotonic() + lease.ttl.ToNanoseconds() / 1e9)
        await asyncio.sleep(0)
        return pb.RenewLeaseResponse(lease=self.lease_of(request.lease_token))

    async def ReleaseLease(self, request, context):
        self.note("ReleaseLease", request, context)
        await self.known_lease(request, context)
        self.leases.pop(request.lease_token)
        return pb.ReleaseLeaseResponse()

    async def ListLeases(self, request, context):
        self.note("ListLeases", request, context)
        return pb.ListLeasesResponse(leases=[self.lease_of(token) for token in self.leases])
