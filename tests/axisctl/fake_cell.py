"""A fake cell of machines with simulated drives, for tests of clients: an entrance that passes calls on as bytes and serves
CellService, for what real cells do not do when a test wants it: falling silent, answering late, refusing."""
import asyncio

import grpc
import grpc.aio

import simulated  # makes axisd importable
from between import OPTIONS, Between, Threaded, refuse
from axisd.cell.v1 import cell_service_pb2 as pb, cell_service_pb2_grpc as rpc
from axisd.v1 import error_pb2, system_service_pb2 as system_pb, types_pb2

OWN = "press-1"


def silence(name):
    return error_pb2.ErrorDetail(reason=error_pb2.REASON_OFFLINE, message=f"{name}: does not answer: connection refused",
                                 remedy="look at the machine", outcome=error_pb2.OUTCOME_NOT_SENT)


class Forwarder(grpc.GenericRpcHandler):
    def __init__(self, cell):
        self._cell = cell

    def service(self, details):
        if details.method.startswith("/axisd.cell.v1."):
            return None
        asked = dict(details.invocation_metadata)

        async def forward(requests, context):
            name = asked.get("axisd-machine", OWN)
            self._cell.forwarded.append((name, details.method.rpartition("/")[2]))
            if name not in self._cell.machines:
                await refuse(context, grpc.StatusCode.NOT_FOUND, error_pb2.ErrorDetail(
                    reason=error_pb2.REASON_INVALID_ARGUMENT, message=f"there is no machine '{name}'",
                    remedy="axisctl machines shows those of the cell"))
            if (arrived := self._cell.holding.get((name, details.method.rpartition("/")[2]))) is not None:
                arrived.set()
                await asyncio.Event().wait()
            if name in self._cell.silent:
                await refuse(context, grpc.StatusCode.UNAVAILABLE, silence(name))
            try:
                async for message in self._cell.machines[name].serve(details, requests, context):
                    yield message
            except asyncio.CancelledError:
                if name not in self._cell.silent:
                    raise
                await refuse(context, grpc.StatusCode.UNAVAILABLE, silence(name))
        return grpc.stream_stream_rpc_method_handler(forward)


class Machine(Between):
    def __init__(self, daemon):
        super().__init__(daemon.server)
        self.daemon = daemon
        self.axes = list(simulated.AXES)
        self.connect()

    @property
    def inhibited(self):
        return self.daemon.client.info().inhibited

    @property
    def leases(self):
        return self.daemon.leases()

    def call(self, method, request, response):
        return self.channel.unary_unary(method, request_serializer=type(request).SerializeToString,
                                        response_deserializer=response.FromString)(request)


class FakeCell(rpc.CellServiceServicer):
    """`machines`: by name. `silent`: names of those that do not answer; `gone`: of these, those that are not
    registered either. `forwarded`: (machine, method).
    `holding`: events by (machine, method) of calls that are never answered, set when one has come. `readers`:
    of events of the cell, so far. `moves`: requests of MoveGroup."""

    def __init__(self, names):
        self.machines = {name: Machine(daemon) for name, daemon in zip(names, simulated.daemons(*names))}
        self.silent, self.gone, self.forwarded, self.reasons = set(), set(), [], []
        self.changed = asyncio.Condition()
        self.changes, self.events, self.latches = [], [], []
        self.not_shared = None
        self.holding, self.readers, self.moves = {}, 0, []

    async def serve(self):
        """Returns the entrance and its port."""
        entrance = grpc.aio.server(options=OPTIONS)
        entrance.add_generic_rpc_handlers((Forwarder(self),))
        rpc.add_CellServiceServicer_to_server(self, entrance)
        port = entrance.add_insecure_port("127.0.0.1:0")
        await entrance.start()
        return [entrance], port

    def message(self, name):
        machine = self.machines[name]
        state = "GONE" if name in self.gone else "SILENT" if name in self.silent else "PRESENT"
        told = pb.Machine(name=name, axisd_address=f"{name}:7443", axes=list(machine.axes), version="0.1.0",
                          state=f"MACHINE_STATE_{state}", stop_all=machine.inhibited, own=name == OWN,
                          trouble="connection refused" if name in self.silent else "")
        told.since.FromSeconds(1_800_000_000)
        if name not in self.silent:
            told.round_trip.FromNanoseconds(400_000)
        return told

    async def fall_silent(self, name):
        """The machine answers no more, and what is open to it ends."""
        self.silent.add(name)
        for call in list(self.machines[name].open):
            call.cancel()
        await self.happen(name, "present -> silent: connection refused")

    async def come_back(self, name):
        self.silent.discard(name)
        await self.happen(name, "silent -> present")

    async def happen(self, name, text):
        event = pb.CellEvent(sequence=len(self.events) + 1, kind=pb.CELL_EVENT_KIND_MACHINE, machine=name, text=text)
        event.at.GetCurrentTime()
        self.events.append(event)
        async with self.changed:
            self.changes.append(name)
            self.changed.notify_all()

    async def GetCell(self, request, context):
        return pb.GetCellResponse(cell="hall-1", machine=OWN, version="0.1.0", instance_id="fake", client="anna",
                                  registry=pb.REGISTRY_STATE_OK, stop_all=self.latches)

    async def ListMachines(self, request, context):
        return pb.ListMachinesResponse(machines=[self.message(name) for name in self.machines])

    async def WatchMachines(self, request, context):
        seen = len(self.changes)  # before the first message: what comes while it is sent counts
        yield pb.WatchMachinesResponse(machines=[self.message(name) for name in self.machines])
        while True:
            async with self.changed:
                await self.changed.wait_for(lambda: len(self.changes) > seen)
            names, seen = self.changes[seen:], len(self.changes)
            yield pb.WatchMachinesResponse(machines=[self.message(name) for name in dict.fromkeys(names)])

    async def StopAll(self, request, context):
        self.reasons.append(request.reason)
        self.latches = [pb.StopAllLatch(id="1", by="anna", entrance=OWN, reason=request.reason)]
        response = pb.StopAllResponse(latch=self.latches[0], not_shared=self.not_shared)
        for name, machine in self.machines.items():
            stop = response.machines.add(machine=name)
            if name in self.silent:
                stop.outcome = pb.MACHINE_OUTCOME_SILENT
                stop.error.CopyFrom(silence(name))
                continue
            stop.outcome = pb.MACHINE_OUTCOME_DONE
            stop.took.FromNanoseconds(2_000_000)
            stop.response.CopyFrom(await machine.call("/axisd.v1.SystemService/StopAll", system_pb.StopAllRequest(),
                                                      system_pb.StopAllResponse))
            del stop.response.results[2:]  # without those that cannot stop
        return response

    async def ReleaseStopAll(self, request, context):
        response = pb.ReleaseStopAllResponse(released=self.latches)
        self.latches = []
        for name, machine in self.machines.items():
            release = response.machines.add(machine=name)
            if name in self.silent:
                release.outcome = pb.MACHINE_OUTCOME_SILENT
                release.error.CopyFrom(silence(name))
                continue
            await machine.call("/axisd.v1.SystemService/ReleaseStopAll", system_pb.ReleaseStopAllRequest(),
                               system_pb.ReleaseStopAllResponse)
            release.outcome = pb.MACHINE_OUTCOME_DONE
        return response

    async def MoveGroup(self, request, context):
        """Is done at once, without anything having moved; `sticky` fails."""
        self.moves.append(request)
        move = pb.CellGroupMove(state=types_pb2.COMMAND_STATE_DONE)
        for number, part in enumerate(request.machines):
            if part.machine in self.silent:
                await refuse(context, grpc.StatusCode.UNAVAILABLE, silence(part.machine))
            answer = move.machines.add(machine=part.machine)
            answer.move.id = f"g-{number}"
            answer.clock_error.FromNanoseconds(50_000)
            answer.started_after.FromNanoseconds(number * 2_000_000)
            for target in part.targets:
                state = types_pb2.COMMAND_STATE_ERROR if target.axis == "sticky" else types_pb2.COMMAND_STATE_DONE
                member = answer.move.members.add(command=types_pb2.Command(id=f"c-{number}", axis=target.axis, state=state))
                member.started_after.FromNanoseconds(1_000_000)
                if target.axis == "sticky":
                    cause = error_pb2.ErrorDetail(reason=error_pb2.REASON_NOT_CONFIRMED, message="sticky: it did not arrive")
                    member.command.cause.CopyFrom(cause)
                    move.state = state
                    move.cause.CopyFrom(cause)
                    move.cause.message = f"{part.machine}: {cause.message}"
        move.start_skew.FromNanoseconds(2_000_000)
        move.start_skew_error.FromNanoseconds(100_000)
        return pb.MoveGroupResponse(move=move)

    async def WatchEvents(self, request, context):
        cursor = request.after_sequence if request.HasField("after_sequence") else len(self.events)
        self.readers += 1
        first = True
        while True:
            events = self.events[cursor:]
            if events or first:
                cursor, first = len(self.events), False
                yield pb.WatchEventsResponse(instance_id="fake", events=events, cursor=cursor, newest=cursor)
            await asyncio.sleep(0.01)


class ThreadedCell(Threaded):
    """The same on a thread of its own."""

    def __init__(self, names):
        super().__init__(self._serve)
        self._names = names

    async def _serve(self):
        self.cell = FakeCell(self._names)
        return await self.cell.serve()

    async def _close(self):
        for machine in self.cell.machines.values():
            await machine.channel.close()

    def calls(self, machine, method):
        return self.cell.machines[machine].requests(method)
