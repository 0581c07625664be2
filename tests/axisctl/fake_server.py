"""A daemon for tests of clients: speaks axisd.v1 and moves imaginary axes in real time, without axisd.

Axes: `feeder` (mm, soft limits 0 to 400, simulated), `turntable` (deg), `ghost` (offline), `sticky` (each move ends
in Error not_reached). Velocities are granted in steps of 3 units per second, as whole r/min would do.
"""
import asyncio
import contextlib
import time

import grpc
import grpc.aio
from google.protobuf import duration_pb2
from between import OPTIONS, Threaded
from fake_axis import ENDS, STEP, FakeAxis, offline_detail, refuse  # makes axisd importable
from fake_drives import SERVICES, FakeDrives, FakeEvents, FakeNodes
from fake_groups import SERVICES as GROUP_SERVICES, FakeGroups
from fake_leases import SERVICES as LEASE_SERVICES, FakeLeases
from fake_state import FakeState
from axisd.v1 import (axis_service_pb2 as axes_pb, axis_service_pb2_grpc as axes_rpc,
                      budget_pb2 as budget_pb, bus_service_pb2 as bus_pb, bus_service_pb2_grpc as bus_rpc,
                      command_service_pb2 as command_pb, command_service_pb2_grpc as command_rpc,
                      error_pb2, system_service_pb2 as system_pb, system_service_pb2_grpc as system_rpc, types_pb2)

GRANTED_STEP = 3.0


class FakeMachine(FakeDrives, FakeNodes, FakeEvents, FakeGroups, FakeLeases, FakeState,
                  axes_rpc.AxisServiceServicer, command_rpc.CommandServiceServicer, bus_rpc.BusServiceServicer,
                  system_rpc.SystemServiceServicer):
    """All services. `calls` records (method, request, peer) of every call, for assertions. `losing`: of how many calls
    of a method the answer is lost, after it was carried out."""

    def __init__(self):
        FakeDrives.__init__(self)
        FakeEvents.__init__(self)
        FakeLeases.__init__(self)
        FakeState.__init__(self)
        self.inhibited = False
        self.heeds_delegates = True
        self.instance_id = "fake"
        self.log_level = system_pb.LOG_LEVEL_INFO
        self.calls = []
        self.losing = {}
        self.commands = {}
        self.by_request = {}
        self.changed = asyncio.Condition()
        self.axes = {axis.name: axis for axis in (
            FakeAxis(self, "feeder", "mm", 1, (0.0, 400.0)), FakeAxis(self, "turntable", "deg", 2),
            FakeAxis(self, "ghost", "mm", 9), FakeAxis(self, "sticky", "mm", 3))}
        for name in ("feeder", "sticky"):
            self.axes[name].state.state = types_pb2.STATE_STANDSTILL
            self.axes[name].state.enabled = self.axes[name].state.enabled_by_daemon = True
            self.axes[name].state.trust = types_pb2.POSITION_TRUST_HOMED

    # Bookkeeping

    def change(self, command, state, cause=None):
        command.state = state
        if cause is not None:
            command.cause.CopyFrom(cause)
        if state == types_pb2.COMMAND_STATE_ACTIVE:
            command.started_at.GetCurrentTime()
        if state in ENDS:
            command.ended_at.GetCurrentTime()

        async def notify():
            async with self.changed:
                self.changed.notify_all()
        self.notifying = asyncio.ensure_future(notify())

    def note(self, method, request, context):
        self.calls.append((method, request, context.peer()))

    async def find(self, name, context):
        axis = self.axes.get(name)
        if axis is None:
            await refuse(context, grpc.StatusCode.NOT_FOUND, error_pb2.ErrorDetail(
                reason=error_pb2.REASON_UNKNOWN_AXIS, message=f"no axis '{name}'",
                remedy="axisctl list shows all: " + ", ".join(self.axes)))
        return axis

    async def ready(self, request, context, powered=True):
        axis = await self.find(request.axis, context)
        if axis.name == "ghost":
            await refuse(context, grpc.StatusCode.UNAVAILABLE, offline_detail())
        if self.inhibited and powered:
            await refuse(context, grpc.StatusCode.FAILED_PRECONDITION, error_pb2.ErrorDetail(
                reason=error_pb2.REASON_INHIBITED, message="all axes are stopped",
                remedy="release it: axisctl release-stop --all"))
        if powered:
            await self.accepted(context)
        if powered and not axis.state.enabled:
            await refuse(context, grpc.StatusCode.FAILED_PRECONDITION, error_pb2.ErrorDetail(
                reason=error_pb2.REASON_DISABLED, message="the power stage is off", remedy="enable the axis"))
        return axis

    def command(self, axis, kind, request, **asked):
        command = types_pb2.Command(id=f"c-{len(self.commands) + 1}", axis=axis.name, kind=kind,
                                    state=types_pb2.COMMAND_STATE_ACCEPTED, client="test",
                                    request_id=request.options.request_id)
        for name, value in asked.items():
            setattr(command.asked, name, value)
        for name in ("acceleration_time", "deceleration_time", "hold"):
            if name in request.DESCRIPTOR.fields_by_name and name != "hold" and request.HasField(name):
                getattr(command.asked, name).CopyFrom(getattr(request, name))
        command.granted.CopyFrom(command.asked)
        if command.asked.HasField("velocity"):
            command.granted.velocity = int(command.asked.velocity / GRANTED_STEP) * GRANTED_STEP
        command.accepted_at.GetCurrentTime()
        self.commands[command.id] = command
        self.by_request[command.request_id] = command
        return command

    async def wait(self, command, until):
        while until == types_pb2.WAIT_UNTIL_DONE and command.state not in ENDS:
            async with self.changed:
                with contextlib.suppress(asyncio.TimeoutError):
                    await asyncio.wait_for(self.changed.wait(), 0.05)
        return command

    async def at_once(self, kind, request, context, response, apply, powered=False):
        """A command that needs no time."""
        axis = await self.ready(request, context, powered)
        command = self.command(axis, kind, request)
        axis.begin(command, asyncio.sleep(0))
        apply(axis)
        axis.end(types_pb2.COMMAND_STATE_DONE)
        return response(command=command)

    # AxisService

    async def ListAxes(self, request, context):
        self.note("ListAxes", request, context)
        return axes_pb.ListAxesResponse(axes=[axis.snapshot() for axis in self.axes.values()])

    async def GetAxis(self, request, context):
        self.note("GetAxis", request, context)
        return axes_pb.GetAxisResponse(state=(await self.find(request.axis, context)).snapshot())

    async def WatchAxes(self, request, context):
        self.note("WatchAxes", request, context)
        axes = [await self.find(name, context) for name in request.axes or self.axes]
        tick = 0
        while True:
            tick += 1
            states = [axis.snapshot(request.fields.paths) for axis in axes]
            yield axes_pb.WatchAxesResponse(instance_id="fake", tick=tick, axes=states)
            await asyncio.sleep(request.period.ToTimedelta().total_seconds() or 0.1)

    async def Enable(self, request, context):
        self.note("Enable", request, context)

        def apply(axis):
            axis.state.enabled = axis.state.enabled_by_daemon = True
            axis.state.state = types_pb2.STATE_STANDSTILL
        return await self.at_once(types_pb2.COMMAND_KIND_ENABLE, request, context, axes_pb.EnableResponse, apply)

    async def Disable(self, request, context):
        self.note("Disable", request, context)

        def apply(axis):
            axis.state.enabled = axis.state.enabled_by_daemon = False
            axis.state.state = types_pb2.STATE_DISABLED
        return await self.at_once(types_pb2.COMMAND_KIND_DISABLE, request, context, axes_pb.DisableResponse, apply)

    async def Reset(self, request, context):
        self.note("Reset", request, context)

        def apply(axis):
            axis.state.state = types_pb2.STATE_STANDSTILL
        return await self.at_once(types_pb2.COMMAND_KIND_RESET, request, context, axes_pb.ResetResponse, apply)

    async def SetPosition(self, request, context):
        self.note("SetPosition", request, context)

        def apply(axis):
            axis.state.position = request.position
            axis.state.trust = types_pb2.POSITION_TRUST_SET
        return await self.at_once(types_pb2.COMMAND_KIND_SET_POSITION, request, context,
                                  axes_pb.SetPositionResponse, apply)

    async def Home(self, request, context):
        self.note("Home", request, context)
        axis = await self.ready(request, context)
        command = self.command(axis, types_pb2.COMMAND_KIND_HOME, request)
        axis.state.trust = types_pb2.POSITION_TRUST_HOMED
        axis.begin(command, axis.travel(command, 0.0, 1000.0, types_pb2.STATE_HOMING))
        return axes_pb.HomeResponse(command=await self.wait(command, request.options.wait_until))

    async def go(self, kind, request, context, target, **asked):
        axis = await self.ready(request, context)
        if request.options.request_id in self.by_request:
            return await self.wait(self.by_request[request.options.request_id], request.options.wait_until)
        target += axis.state.position if kind == types_pb2.COMMAND_KIND_MOVE_RELATIVE else 0
        if axis.limits and not axis.limits[0] <= target <= axis.limits[1]:
            await refuse(context, grpc.StatusCode.OUT_OF_RANGE, error_pb2.ErrorDetail(
                reason=error_pb2.REASON_SOFT_LIMIT, message=f"position {target:g} mm is beyond the soft limit",
                remedy="choose a target inside", permitted=error_pb2.PermittedRange(
                    minimum=axis.limits[0], maximum=axis.limits[1], unit="mm")))
        velocity = request.velocity if request.HasField("velocity") else 600.0
        command = self.command(axis, kind, request, velocity=velocity, **asked)
        axis.begin(command, axis.travel(command, target, command.granted.velocity,
                                        types_pb2.STATE_DISCRETE_MOTION))
        return await self.wait(command, request.options.wait_until)

    async def MoveAbsolute(self, request, context):
        self.note("MoveAbsolute", request, context)
        return axes_pb.MoveAbsoluteResponse(command=await self.go(
            types_pb2.COMMAND_KIND_MOVE_ABSOLUTE, request, context, request.position, position=request.position))

    async def MoveRelative(self, request, context):
        self.note("MoveRelative", request, context)
        return axes_pb.MoveRelativeResponse(command=await self.go(
            types_pb2.COMMAND_KIND_MOVE_RELATIVE, request, context, request.distance, distance=request.distance))

    async def MoveVelocity(self, request, context):
        self.note("MoveVelocity", request, context)
        axis = await self.ready(request, context)
        command = self.command(axis, types_pb2.COMMAND_KIND_MOVE_VELOCITY, request, velocity=request.velocity)
        axis.begin(command, axis.run(command, request.velocity, request.hold.ToTimedelta().total_seconds()))
        return axes_pb.MoveVelocityResponse(command=await self.wait(command, request.options.wait_until))

    async def Jog(self, request, context):
        self.note("Jog", request, context)
        hold = request.hold.ToTimedelta().total_seconds() or 0.3
        repeated = self.by_request.get(request.options.request_id)
        if repeated is not None:
            axis = self.axes[request.axis]
            if axis.current is not None and axis.current.id == repeated.id:
                axis.hold_until = time.monotonic() + hold
            return axes_pb.JogResponse(command=self.commands[repeated.id])
        axis = await self.ready(request, context)
        command = self.command(axis, types_pb2.COMMAND_KIND_JOG, request, velocity=request.velocity)
        axis.begin(command, axis.run(command, request.velocity, hold))
        return axes_pb.JogResponse(command=command)

    async def halting(self, method, kind, request, context, response):
        self.note(method, request, context)
        axis = await self.ready(request, context, powered=False)
        axis.end(types_pb2.COMMAND_STATE_ABORTED, error_pb2.ErrorDetail(
            reason=error_pb2.REASON_SUPERSEDED, message=f"a {method} took its place"))
        command = self.command(axis, kind, request)
        if getattr(request, "hold", False):
            self.hold(axis, request.options.request_id)
        axis.state.stop_held = bool(axis.state.holds)
        if axis.state.enabled:
            axis.state.state = types_pb2.STATE_STOPPING if axis.state.holds else types_pb2.STATE_STANDSTILL
        self.change(command, types_pb2.COMMAND_STATE_DONE)
        return response(command=command)

    @staticmethod
    def hold(axis, request_id, holder="local:localhost"):
        if not any((hold.holder, hold.request_id) == (holder, request_id) for hold in axis.state.holds):
            hold = axis.state.holds.add(holder=holder, request_id=request_id, durable=True)
            hold.since.FromSeconds(1_700_000_000)

    @staticmethod
    def release(axis, request):
        """The error, if there is none of these."""
        def meant(hold):
            mine = hold.holder == "local:localhost"
            return request.everybody or mine and (request.mine or hold.request_id == request.request_id)
        kept = [hold for hold in axis.state.holds if not meant(hold)]
        if len(kept) == len(axis.state.holds):
            return error_pb2.ErrorDetail(reason=error_pb2.REASON_INVALID_ARGUMENT, message=f"{axis.name}: no such hold")
        del axis.state.holds[:]
        axis.state.holds.extend(kept)
        axis.state.stop_held = bool(kept)
        if not kept:
            axis.state.state = types_pb2.STATE_STANDSTILL
        return None

    async def Halt(self, request, context):
        return await self.halting("Halt", types_pb2.COMMAND_KIND_HALT, request, context, axes_pb.HaltResponse)

    async def Stop(self, request, context):
        return await self.halting("Stop", types_pb2.COMMAND_KIND_STOP, request, context, axes_pb.StopResponse)

    async def QuickStop(self, request, context):
        return await self.halting("QuickStop", types_pb2.COMMAND_KIND_QUICK_STOP, request, context,
                                  axes_pb.QuickStopResponse)

    async def ReleaseStop(self, request, context):
        self.note("ReleaseStop", request, context)
        axis = await self.ready(request, context, powered=False)
        if (error := self.release(axis, request)) is not None:
            await refuse(context, grpc.StatusCode.INVALID_ARGUMENT, error)
        return axes_pb.ReleaseStopResponse(command=types_pb2.Command(
            id="c-0", axis=axis.name, kind=types_pb2.COMMAND_KIND_STOP, state=types_pb2.COMMAND_STATE_DONE),
            holds=axis.state.holds)

    # CommandService

    async def known(self, request, context):
        command = self.commands.get(request.id)
        if command is None:
            await refuse(context, grpc.StatusCode.NOT_FOUND, error_pb2.ErrorDetail(
                reason=error_pb2.REASON_UNKNOWN_COMMAND, message=f"no command '{request.id}'"))
        return command

    async def GetCommand(self, request, context):
        self.note("GetCommand", request, context)
        return command_pb.GetCommandResponse(command=await self.known(request, context))

    async def WatchCommand(self, request, context):
        self.note("WatchCommand", request, context)
        command = await self.known(request, context)
        shown = None
        while shown not in ENDS:
            if command.state != shown:
                shown = command.state
                yield command_pb.WatchCommandResponse(command=command)
                continue
            await asyncio.sleep(STEP)

    async def CancelCommand(self, request, context):
        self.note("CancelCommand", request, context)
        command = await self.known(request, context)
        axis = self.axes[command.axis]
        if axis.current is command:
            axis.end(types_pb2.COMMAND_STATE_ABORTED, error_pb2.ErrorDetail(
                reason=error_pb2.REASON_CANCELLED, message="cancelled by a client"))
            axis.state.state = types_pb2.STATE_STANDSTILL
        return command_pb.CancelCommandResponse(command=command)

    # BusService, SystemService

    async def ListBuses(self, request, context):
        self.note("ListBuses", request, context)
        return bus_pb.ListBusesResponse(buses=[
            bus_pb.Bus(name="line-a", port="sim", baud=115200, open=True, simulated=True, transactions=1234),
            bus_pb.Bus(name="line-b", port="/dev/ttyUSB7", baud=9600, error=error_pb2.ErrorDetail(
                reason=error_pb2.REASON_BUS_DOWN, message="/dev/ttyUSB7: No such file or directory",
                remedy="check the adapter")),
            bus_pb.Bus(name="can0", port="can0", baud=500000, kind=bus_pb.BUS_KIND_CANOPEN, open=True,
                       network=bus_pb.NetworkStatus(
                           link=bus_pb.NETWORK_LINK_ERROR_PASSIVE, frames_sent=1001, frames_received=2002,
                           frames_not_sent=3, frames_unknown=4, sdo_transfers=505, sdo_aborts=6, sdo_timeouts=7,
                           sync_period=duration_pb2.Duration(nanos=10000000), sync_running=True, sync_sent=808,
                           sync_missed=9, emergencies=10, foreign_nodes=[22, 23], foreign_frames=11,
                           link_helper_error=error_pb2.ErrorDetail(
                               reason=error_pb2.REASON_BUS_DOWN, message="there is no link helper",
                               remedy="enable axisd-link.socket")))])

    async def GetBudget(self, request, context):
        self.note("GetBudget", request, context)
        return bus_pb.GetBudgetResponse(budgets=[budget_pb.BusBudget(
            bus="line-a", load=[budget_pb.LoadBudget(utilisation=0.25, utilisation_max=0.5,
                                                     refresh_idle=duration_pb2.Duration(nanos=300000000))],
            stops=[budget_pb.StopBudget(axes=1, last_frame=duration_pb2.Duration(nanos=28000000))],
            axes=[budget_pb.AxisBudget(
                axis="feeder", unit="mm", way_alone=10.5, deceleration_time=duration_pb2.Duration(nanos=150000000),
                stop_alone=budget_pb.StopBudget(axes=1, last_frame=duration_pb2.Duration(nanos=28000000)),
                observed=budget_pb.ObservedTimes(stop_frame=duration_pb2.Duration(nanos=7000000)))],
            excess=[budget_pb.BudgetExcess(key="stop_bound", message="too late", remedy="raise it")],
            notes=["a note"])])

    async def SetLogLevel(self, request, context):
        self.note("SetLogLevel", request, context)
        previous, self.log_level = self.log_level, request.level or self.log_level
        return system_pb.SetLogLevelResponse(level=self.log_level, previous=previous)

    async def GetInfo(self, request, context):
        self.note("GetInfo", request, context)
        claim = dict(context.invocation_metadata())
        return system_pb.GetInfoResponse(machine="press-1", version="0.1.0", instance_id=self.instance_id,
                                         inhibited=self.inhibited, inhibited_by="test" if self.inhibited else "",
                                         state_unaccepted="; ".join(each.text for each in self.convictions),
                                         storage_error=self.storage_error,
                                         client=f"{claim.get('axisd-user', 'anna')} via web" if self.heeds_delegates
                                         else "unix:anna", identity="unix:anna",
                                         role=f"ROLE_{claim.get('axisd-role', 'operator').upper()}",
                                         axis_roles=[{"axis": "feeder", "role": "ROLE_VIEWER"}])

    async def StopAll(self, request, context):
        self.note("StopAll", request, context)
        self.inhibited = True
        self.happen("", inhibit_change={"kind": "INHIBIT_CHANGE_KIND_LATCHED", "by": "test"})
        results = []
        for axis in self.axes.values():
            if axis.name == "ghost":
                results.append(system_pb.StopResult(axis=axis.name, error=offline_detail()))
                continue
            axis.end(types_pb2.COMMAND_STATE_ABORTED)
            command = types_pb2.Command(id=f"s-{axis.name}", axis=axis.name, kind=types_pb2.COMMAND_KIND_STOP,
                                        state=types_pb2.COMMAND_STATE_DONE)
            results.append(system_pb.StopResult(axis=axis.name, command=command))
        return system_pb.StopAllResponse(results=results, not_durable=self.latch_trouble)

    async def ReleaseStopAll(self, request, context):
        self.note("ReleaseStopAll", request, context)
        self.inhibited = False
        self.happen("", inhibit_change={"kind": "INHIBIT_CHANGE_KIND_RELEASED", "by": "test"})
        return system_pb.ReleaseStopAllResponse()


class Losing(grpc.aio.ServerInterceptor):
    """Cuts the connection, as far as a client can tell, before the answer."""

    def __init__(self, machine):
        self._machine = machine

    async def intercept_service(self, continuation, details):
        handler = await continuation(details)
        method = details.method.rpartition("/")[2]
        if not self._machine.losing.get(method):
            return handler
        self._machine.losing[method] -= 1

        async def lose(request, context):
            await handler.unary_unary(request, context)
            await context.abort(grpc.StatusCode.UNAVAILABLE, "the connection was cut")
        return grpc.unary_unary_rpc_method_handler(lose, handler.request_deserializer, handler.response_serializer)


async def serve(machine, addresses):
    """Starts a server; returns it and the port of the first address (0 for a socket's path)."""
    server = grpc.aio.server(interceptors=[Losing(machine)], options=OPTIONS)
    for add in (axes_rpc.add_AxisServiceServicer_to_server, command_rpc.add_CommandServiceServicer_to_server,
                bus_rpc.add_BusServiceServicer_to_server, system_rpc.add_SystemServiceServicer_to_server, *SERVICES,
                *GROUP_SERVICES, *LEASE_SERVICES):
        add(machine, server)
    ports = [server.add_insecure_port(address) for address in addresses]
    await server.start()
    return server, ports[0]


class ThreadedServer(Threaded):
    """The fake daemon on a thread of its own, on a free TCP port or at an address, and optionally on a socket."""

    def __init__(self, address="127.0.0.1:0", socket_path=None):
        super().__init__(self._serve)
        self._addresses = [address] + ([f"unix:{socket_path}"] if socket_path else [])

    async def _serve(self):
        self.machine = FakeMachine()
        server, port = await serve(self.machine, self._addresses)
        return [server], port

    def calls(self, method):
        """Requests of one method so far."""
        return [request for name, request, _ in self.machine.calls if name == method]

    def peers(self, method):
        return [peer for name, _, peer in self.machine.calls if name == method]
