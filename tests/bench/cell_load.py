"""So many machines as an entrance of a cell sees them: an axisd with its stop lane and an entrance each, which answer what
entrances ask of each other, and a registration in etcd. One process for all of them; cell_load_bench.py and
cell_stop_all_bench.py start it.

    cell_load.py STUBS PKI ETCD COUNT AXES [FIRST]

FIRST: the number of the first machine. Machine 0 is that of the real entrance, which registers it. Prints one line of JSON
once all are there: the machines' addresses. Then it reads lines:

    ask ADDRESS    each machine's entrance asks the one at that address for its clock, as often as real ones do
    change         the last machine registers anew
    hold           all machines were told StopAll by another entrance
    latch ADDRESS NAME ...  the same, and that entrance, which reaches these machines, tells the one at ADDRESS
    received       prints when each machine got StopAll since this was asked last, in s of CLOCK_MONOTONIC, as JSON
"""
import asyncio
import json
import os
import pathlib
import sys
import time

import grpc
import grpc.aio

TTL = 15
CLOCK_PERIOD, CLOCKS_A_SECOND = 2.0, 20
#: As a daemon and an entrance have it: else the pings of idle connections are answered with their end.
OF_SERVERS = [("grpc.http2.min_ping_interval_without_data_ms", 1000), ("grpc.keepalive_time_ms", 2000),
              ("grpc.keepalive_permit_without_calls", 1), ("grpc.http2.max_pings_without_data", 0)]
OF_CLIENTS = [("grpc.use_local_subchannel_pool", 1), *OF_SERVERS[1:]]


class Machine:
    """One of them, without the entrance's questions."""

    def __init__(self, messages, name, axes):
        self.name, self.axes, self.messages = name, [f"axis-{number}" for number in range(axes)], messages
        self.revision = 1
        system, axis = messages.system, messages.axis
        self.inhibited, self.received = False, []
        self.who = {inhibited: system.GetInfoResponse(
            machine=name, version="1.0.0", instance_id=f"{name}-run-{os.getpid()}", inhibited=inhibited,
            role=messages.access.ROLE_MAINTAINER).SerializeToString() for inhibited in (False, True)}
        self.stopped = system.StopAllResponse(results=[
            {"axis": each, "command": {"id": f"{name}-{each}", "axis": each}} for each in self.axes]).SerializeToString()
        self.answers = {
            "/axisd.v1.SystemService/GetConfig": system.GetConfigResponse(revision="r1").SerializeToString(),
            "/axisd.v1.AxisService/ListAxes": axis.ListAxesResponse(
                axes=[{"axis": each} for each in self.axes]).SerializeToString()}

    async def serve(self, credentials):
        self.server = grpc.aio.server(handlers=(self,), options=OF_SERVERS)
        ports = [self.server.add_secure_port("127.0.0.1:0", credentials) for _ in range(3)]
        self.axisd, self.stop, self.cell = (f"127.0.0.1:{port}" for port in ports)
        await self.server.start()

    def service(self, details):
        name = details.method.rpartition("/")[2]
        served = {"GetClock": self.clock, "ExchangeStopAll": self.exchange, "GetInfo": self.info,
                  "StopAll": self.stop_all, "ReleaseStopAll": self.release}.get(name)
        if served is not None:
            return grpc.unary_unary_rpc_method_handler(served)
        answer = self.answers.get(details.method)
        if answer is None:
            return None

        async def known(_request, _context):
            return answer
        return grpc.unary_unary_rpc_method_handler(known)

    async def clock(self, _request, _context):
        answer = self.messages.cell.GetClockResponse(machine=self.name, instance_id=f"{self.name}-entrance")
        answer.clock.FromNanoseconds(time.clock_gettime_ns(time.CLOCK_BOOTTIME))
        return answer.SerializeToString()

    async def info(self, _request, _context):
        return self.who[self.inhibited]

    async def stop_all(self, _request, _context):
        self.received.append(time.monotonic())
        self.inhibited = True
        return self.stopped

    async def release(self, _request, _context):
        self.inhibited = False
        return b""

    async def exchange(self, request, _context):
        """It knows nothing more than the other."""
        told = self.messages.cell.ExchangeStopAllRequest.FromString(request)
        return self.messages.cell.ExchangeStopAllResponse(latches=told.latches).SerializeToString()

    def registration(self):
        return self.messages.kept.Registration(
            name=self.name, cell_address=self.cell, axisd_address=self.axisd, stop_address=self.stop, axes=self.axes,
            version="1.0.0", configuration_revision=f"r{self.revision}", machine_id=f"id-of-{self.name}").SerializeToString()


class Messages:
    def __init__(self, stubs):
        sys.path.insert(0, stubs)
        from api.cell import kept_pb2
        from api.cell.etcd import etcd_pb2
        from axisd.cell.v1 import cell_service_pb2
        from axisd.v1 import access_pb2, axis_service_pb2, system_service_pb2
        self.kept, self.etcd, self.cell = kept_pb2, etcd_pb2, cell_service_pb2
        self.access, self.axis, self.system = access_pb2, axis_service_pb2, system_service_pb2


class Registry:
    def __init__(self, messages, endpoint):
        self.pb, self.channel = messages.etcd, grpc.aio.insecure_channel(endpoint)

    async def ask(self, path, request, response):
        return await self.channel.unary_unary(f"/etcdserverpb.{path}", lambda message: message.SerializeToString(),
                                              response.FromString)(request, timeout=10)

    async def register(self, machine):
        granted = await self.ask("Lease/LeaseGrant", self.pb.LeaseGrantRequest(TTL=TTL), self.pb.LeaseGrantResponse)
        machine.lease = granted.ID
        await self.write(machine)

    async def write(self, machine):
        await self.ask("KV/Put", self.pb.PutRequest(key=f"/axisd/load/machines/{machine.name}".encode(),
                                                    value=machine.registration(), lease=machine.lease), self.pb.PutResponse)

    async def keep_alive(self, machine, delay):
        """Each on a stream of its own, as an entrance does."""
        await asyncio.sleep(delay)
        stream = self.channel.stream_stream("/etcdserverpb.Lease/LeaseKeepAlive", lambda message: message.SerializeToString(),
                                            self.pb.LeaseKeepAliveResponse.FromString)()
        while True:
            await stream.write(self.pb.LeaseKeepAliveRequest(ID=machine.lease))
            await stream.read()
            await asyncio.sleep(TTL / 3)


async def ask_for_clock(messages, address, credentials, delay, period):
    """As the entrance of another machine does."""
    await asyncio.sleep(delay)
    channel = grpc.aio.secure_channel(address, credentials, OF_CLIENTS)
    ask = channel.unary_unary("/axisd.cell.v1.CellService/GetClock")
    while True:
        await ask(messages.cell.GetClockRequest().SerializeToString(), timeout=5)
        await asyncio.sleep(period)


async def latch(messages, address, credentials, reached):
    """As the entrance of another machine does that was asked for StopAll, and has told all machines."""
    async with grpc.aio.secure_channel(address, credentials, OF_CLIENTS) as channel:
        request = messages.cell.ExchangeStopAllRequest(cell="load", reached=reached, latches=[
            {"id": f"another-{os.getpid()}", "by": "load", "reason": "another", "entrance": "another"}])
        await channel.unary_unary("/axisd.cell.v1.CellService/ExchangeStopAll")(request.SerializeToString(), timeout=5)


def hold(machines):
    for machine in machines:
        machine.inhibited = True


async def main(stubs, pki, etcd, count, axes, first="0"):
    messages = Messages(stubs)
    ca, key, certificate = ((pathlib.Path(pki) / name).read_bytes() for name in ("ca.crt", "cell.load.key", "cell.load.crt"))
    served = grpc.ssl_server_credentials([(key, certificate)], ca, require_client_auth=True)
    shown = grpc.ssl_channel_credentials(ca, key, certificate)
    machines = [Machine(messages, f"press-{number}", int(axes)) for number in range(int(first), int(first) + int(count))]
    registry = Registry(messages, etcd)
    for machine in machines:
        await machine.serve(served)
    begin = time.monotonic()
    others = machines if int(first) else machines[1:]
    await asyncio.gather(*[registry.register(machine) for machine in others])
    tasks = [asyncio.create_task(registry.keep_alive(machine, index * TTL / 3 / len(machines)))
             for index, machine in enumerate(others)]
    print(json.dumps([{"name": each.name, "axisd": each.axisd, "stop": each.stop, "served_since": begin} for each in machines]),
          flush=True)
    loop = asyncio.get_running_loop()
    while line := (await loop.run_in_executor(None, sys.stdin.readline)).split():
        if line[0] == "ask":
            period = max(CLOCK_PERIOD, len(machines) / CLOCKS_A_SECOND)
            tasks += [asyncio.create_task(ask_for_clock(messages, line[1], shown, index * period / len(machines), period))
                      for index in range(len(machines) - 1)]
        elif line[0] == "latch":
            hold(machines)
            await latch(messages, line[1], shown, line[2:])
        elif line[0] == "hold":
            hold(machines)
        elif line[0] == "received":
            print(json.dumps({machine.name: machine.received for machine in machines}), flush=True)
            for machine in machines:
                machine.received = []
        else:
            machines[-1].revision += 1
            await registry.write(machines[-1])
    for task in tasks:
        task.cancel()
    await asyncio.gather(*[machine.server.stop(None) for machine in machines])


if __name__ == "__main__":
    asyncio.run(main(*sys.argv[1:]))
