"""Leases the feeder, moves it, renews a few times, and then is a process that SIGSTOP holds: it tells when it last
renewed. Once it goes on it sends what it would have sent then, under the lease that it believes to have."""
import os
import signal
import sys
import time

from harness.client import CallFailed, Client, lease_pb, seconds

TTL = 2.0
RENEWALS = 4


def main():
    client = Client(f"unix:{sys.argv[1]}")
    request = lease_pb.AcquireLeaseRequest(axes=["feeder"], ttl=seconds(TTL), label="e2e")
    token = client.call(client.lease.AcquireLease, request).lease_token
    move = client.motion("MoveAbsolute", "feeder", position=380.0, velocity=20.0, options={"lease_token": token})
    for _ in range(RENEWALS):
        time.sleep(TTL / 4)
        before = time.monotonic_ns()
        client.call(client.lease.RenewLease, lease_pb.RenewLeaseRequest(lease_token=token))
        after = time.monotonic_ns()
    print("held", token, move.id, before, after, flush=True)
    os.kill(os.getpid(), signal.SIGSTOP)
    try:
        client.motion("MoveAbsolute", "feeder", position=300.0, options={"lease_token": token})
        print("moved", flush=True)
    except CallFailed as failure:
        print("refused", failure.code.name, failure.reason, failure.detail.message, flush=True)


if __name__ == "__main__":
    main()
