"""The fake daemon's drives, nodes and events: just enough memory to see what clients make of it."""
import asyncio

import grpc
from fake_axis import refuse  # makes axisd importable
from axisd.v1 import (bus_service_pb2 as bus_pb, drive_service_pb2 as drive_pb, drive_service_pb2_grpc as drive_rpc,
                      error_pb2, event_service_pb2 as event_pb, event_service_pb2_grpc as event_rpc, types_pb2)

CATALOGUE = (
    drive_pb.Parameter(name="version", address=0x01, type=1, maximum=65535, access=1, description="Firmware version"),
    drive_pb.Parameter(name="current", address=0x10, type=1, maximum=11, default_value=6, access=3,
                       description="RMS current"),
    drive_pb.Parameter(name="microstep", address=0x11, type=1, maximum=15, default_value=8, access=3,
                       description="Pulses per revolution", configured_by="scale.microstep"),
    drive_pb.Parameter(name="start_speed", address=0x20, type=1, unit="r/min", minimum=2, maximum=300, default_value=5,
                       access=2, description="Speed at which a motion begins"),
    drive_pb.Parameter(name="maximum_speed", address=0x23, type=2, unit="r/min", minimum=-3000, maximum=3000,
                       default_value=60, access=2, description="Speed of the motion"),
    drive_pb.Parameter(name="stop", address=0x28, type=1, maximum=2, access=4, description="Stops",
                       instead="AxisService.Stop"))


def invalid(message, remedy="", **fields):
    return error_pb2.ErrorDetail(reason=error_pb2.REASON_INVALID_ARGUMENT, message=message, remedy=remedy, **fields)


class FakeDrives(drive_rpc.DriveServiceServicer):
    """DriveService of every axis; `memory` is that of one drive."""

    def __init__(self):
        self.memory = {"version": 256, "current": 6, "microstep": 8, "start_speed": 5, "maximum_speed": -60}
        self.table = drive_pb.SegmentTable()

    async def confirmed(self, request, context):
        if request.confirm != request.axis:
            await refuse(context, grpc.StatusCode.INVALID_ARGUMENT, invalid(
                f'confirm is "{request.confirm}", not the axis\'s name', "repeat the axis's name in confirm"))

    def value(self, name):
        address = next(parameter.address for parameter in CATALOGUE if parameter.name == name)
        return drive_pb.ParameterValue(name=name, address=address, value=self.memory[name])

    async def GetDrive(self, request, context):
        self.note("GetDrive", request, context)
        await self.find(request.axis, context)
        inputs = [drive_pb.TerminalCapability(name=f"X{i}", functions=["none", "home", "positive_limit"])
                  for i in range(2)]
        return drive_pb.GetDriveResponse(
            axis=request.axis, model="ykd2405pr", title="YKD2405PR", model_code=0x301, version="V1.0",
            pulses_per_revolution=[200, 10000], maximum_rpm=3000, maximum_pulse_rate_hz=200000, maximum_segments=16,
            homing_methods=["home_positive"], inputs=inputs, bauds=[9600, 115200], eeprom_writes=3,
            alarms=[drive_pb.AlarmDescription(code=2, name="overvoltage", reset=2, remedy="check the supply")])

    async def ListParameters(self, request, context):
        self.note("ListParameters", request, context)
        await self.find(request.axis, context)
        return drive_pb.ListParametersResponse(model="ykd2405pr", parameters=CATALOGUE)

    async def ReadParameters(self, request, context):
        self.note("ReadParameters", request, context)
        for name in request.names:
            if name not in self.memory:
                await refuse(context, grpc.StatusCode.INVALID_ARGUMENT, invalid(
                    f'ykd2405pr has no parameter "{name}"', "did you mean current?"))
        return drive_pb.ReadParametersResponse(values=[self.value(name) for name in request.names or self.memory])

    async def WriteParameters(self, request, context):
        self.note("WriteParameters", request, context)
        for value in request.values:
            if value.name == "stop":
                await refuse(context, grpc.StatusCode.INVALID_ARGUMENT, invalid(
                    "stop triggers an action", "use AxisService.Stop", bus="line-a", node=1, object=0x28))
        self.memory.update((value.name, value.value) for value in request.values)
        return drive_pb.WriteParametersResponse(values=[self.value(value.name) for value in request.values])

    async def SaveParameters(self, request, context):
        self.note("SaveParameters", request, context)
        await self.confirmed(request, context)
        return drive_pb.SaveParametersResponse()

    async def RestoreFactory(self, request, context):
        self.note("RestoreFactory", request, context)
        await self.confirmed(request, context)
        return drive_pb.RestoreFactoryResponse(after_power_cycle="node by its switches, 9600 8N1")

    async def ReadSegments(self, request, context):
        self.note("ReadSegments", request, context)
        return drive_pb.ReadSegmentsResponse(segments=self.table)

    async def WriteSegments(self, request, context):
        self.note("WriteSegments", request, context)
        self.table = request.segments
        return drive_pb.WriteSegmentsResponse(segments=self.table)

    async def changes(self, method, request, context, response):
        self.note(method, request, context)
        await self.confirmed(request, context)
        yield response(phase=drive_pb.SERIAL_PHASE_WRITTEN, text="SW1 to SW5 must be off")
        if request.HasField("verify"):
            yield response(phase=drive_pb.SERIAL_PHASE_WAITING, text="looking for it")
            if request.verify.seconds > 60:  # nobody switches it off
                await asyncio.sleep(request.verify.seconds)
            yield response(phase=drive_pb.SERIAL_PHASE_VERIFIED, text="it answers")

    async def Readdress(self, request, context):
        async for change in self.changes("Readdress", request, context, drive_pb.ReaddressResponse):
            yield change

    async def SetSerial(self, request, context):
        async for change in self.changes("SetSerial", request, context, drive_pb.SetSerialResponse):
            yield change


class FakeNodes:
    """What BusService knows beside the list of buses."""

    async def ListDevices(self, request, context):
        self.note("ListDevices", request, context)
        return bus_pb.ListDevicesResponse(devices=[bus_pb.Device(
            name="valves", bus="line-a", node=40, link=types_pb2.LINK_STATE_ONLINE,
            values=[bus_pb.DeviceValue(name="pressure", value=2.5, unit="bar", writable=True),
                    bus_pb.DeviceValue(name="flow")])])

    async def WriteDevice(self, request, context):
        self.note("WriteDevice", request, context)
        return bus_pb.WriteDeviceResponse(value=round(request.value, 1))

    async def Transact(self, request, context):
        self.note("Transact", request, context)
        if request.HasField("write") and request.node == 1:
            await refuse(context, grpc.StatusCode.INVALID_ARGUMENT, invalid("node 1 is the axis feeder"))
        if request.HasField("read_object"):
            return bus_pb.TransactResponse(data=b"\x37\x02", value=0x237)
        return bus_pb.TransactResponse(values=[0xFFFF - i for i in range(request.read)])

    async def GetBusStatistics(self, request, context):
        self.note("GetBusStatistics", request, context)
        return bus_pb.GetBusStatisticsResponse(buses=self.statistics())

    async def WatchBusStatistics(self, request, context):
        self.note("WatchBusStatistics", request, context)
        while True:
            yield bus_pb.WatchBusStatisticsResponse(buses=self.statistics())
            await asyncio.sleep(0.01)

    @staticmethod
    def statistics():
        line = bus_pb.BusStatistics(bus="line-a", kind=bus_pb.BUS_KIND_MODBUS_RTU, utilisation=0.25, classes=[
            bus_pb.ClassStatistics(transaction_class=bus_pb.TRANSACTION_CLASS_MOTION, sent=10, dropped_superseded=2,
                                   queueing=bus_pb.LatencyHistogram(counts=[5, 5]))], nodes=[
            bus_pb.NodeStatistics(node=1, name="feeder", line=bus_pb.LineNodeStatistics(
                replies=9, timeouts=1, quarantine=bus_pb.Quarantine(active=True, probes=4, times=1)),
                unknown_starts=bus_pb.UnknownOutcomes(executed=2))], held_back=3)
        line.nodes[0].line.quarantine.lasting.FromSeconds(75)
        line.nodes[0].line.quarantine.next_probe_in.FromMilliseconds(250)
        line.since_start.FromSeconds(60)
        line.classes[0].queueing.longest.FromMicroseconds(110)
        network = bus_pb.BusStatistics(bus="can0", kind=bus_pb.BUS_KIND_CANOPEN, nodes=[
            bus_pb.NodeStatistics(node=5, network=bus_pb.NetworkNodeStatistics(sdo_timeouts=3, tpdos=40))])
        return [line, network]

    async def TraceBus(self, request, context):
        self.note("TraceBus", request, context)
        yield bus_pb.TraceBusResponse()
        sent = bus_pb.TracedFrame(sequence=7, monotonic_ns=5, kind=bus_pb.TRACE_KIND_SENT, node=5,
                                  transaction_class=bus_pb.TRANSACTION_CLASS_STOP, data=b"\x40\x41\x60\0\0\0\0\0",
                                  can=bus_pb.CanIdentifier(id=0x605, length=8), text="5 can0 tx 605#4041600000000000")
        sent.at.FromNanoseconds(1_700_000_000_123_456_789)
        yield bus_pb.TraceBusResponse(frames=[sent], lost=3)
        yield bus_pb.TraceBusResponse(frames=[bus_pb.TracedFrame(
            sequence=8, monotonic_ns=6, kind=bus_pb.TRACE_KIND_LINK, why="bus_off", text="6 can0 link bus_off")])
        await asyncio.sleep(3600)

    async def ListFlightRecords(self, request, context):
        self.note("ListFlightRecords", request, context)
        record = bus_pb.FlightRecord(name="line-a-1.wire", bus="line-a", reason="feeder: ErrorStop: alarm 2", size=77)
        record.written_at.FromSeconds(1_700_000_000)
        return bus_pb.ListFlightRecordsResponse(records=[record])

    async def GetFlightRecord(self, request, context):
        self.note("GetFlightRecord", request, context)
        return bus_pb.GetFlightRecordResponse(text="# bus: line-a\n")

    async def WriteFlightRecord(self, request, context):
        self.note("WriteFlightRecord", request, context)
        return bus_pb.WriteFlightRecordResponse(name="line-a-2.wire")

    async def Scan(self, request, context):
        self.note("Scan", request, context)
        if request.bus == "endless":
            yield bus_pb.ScanResponse(probed=1, total=127, found=[bus_pb.FoundNode(node=9, baud=9600, format="8N1")])
            await asyncio.sleep(3600)
        if request.bus == "can0":
            yield bus_pb.ScanResponse(probed=127, total=127, found=[
                bus_pb.FoundNode(node=5, baud=500000, model="ykd2405pr", device_type=0x40192, vendor=0x100, product=3,
                                 pulses_per_revolution=4000),
                bus_pb.FoundNode(node=9, baud=500000, device_type=0x191, configured_as="valves"),
                bus_pb.FoundNode(node=22, baud=500000, note="it sends, but answers no SDO")])
            return
        first, last = request.first_node or 1, request.last_node or 127
        known = {1: bus_pb.FoundNode(node=1, baud=115200, format="8N1", model="ykd2405pr", version="V1.0",
                                     pulses_per_revolution=10000, configured_as="feeder"),
                 5: bus_pb.FoundNode(node=5, baud=115200, format="8N1", model="ykd2405pr", version="V1.0",
                                     pulses_per_revolution=2000),
                 8: bus_pb.FoundNode(node=8, baud=115200, format="8N1",
                                     note="garbled replies: two nodes on one address?")}
        total = last - first + 1
        for node in range(first, last + 1):
            yield bus_pb.ScanResponse(probed=node - first + 1, total=total,
                                      found=[known[node]] if node in known else [])


class FakeEvents(event_rpc.EventServiceServicer):
    """EventService; `happen` adds an event."""

    def __init__(self):
        self.events = []
        self.happen("feeder", state_change=event_pb.StateChange(
            **{"from": types_pb2.STATE_STANDSTILL}, to=types_pb2.STATE_DISCRETE_MOTION,
            cause=types_pb2.MOTION_CAUSE_TERMINAL))
        edge = event_pb.TerminalEdge(terminal="X0", function="home", active=True)
        edge.after.FromMilliseconds(1000)
        edge.before.FromMilliseconds(1020)
        self.happen("feeder", terminal_edge=edge)
        self.happen("ghost", link_change=event_pb.LinkChange(to=types_pb2.LINK_STATE_OFFLINE, detail="no reply"))
        self.happen("turntable", configuration_drift=event_pb.ConfigurationDrift(text="X1 has no function"))

    def happen(self, axis, **content):
        event = event_pb.Event(sequence=len(self.events) + 1, axis=axis, **content)
        event.at.FromMilliseconds(1_700_000_000_123 + len(self.events))
        self.events.append(event)

    async def WatchEvents(self, request, context):
        self.note("WatchEvents", request, context)
        kinds = {event_pb.EventKind.Value("EVENT_KIND_" + field.name.upper()): field.name
                 for field in event_pb.Event.DESCRIPTOR.oneofs_by_name["content"].fields}
        wanted = {kinds[kind] for kind in request.kinds} or set(kinds.values())
        cursor = len(self.events)
        if request.HasField("after_sequence"):
            cursor = request.after_sequence if request.instance_id == "fake" else 0
        greeted = False
        while True:
            batch = [event for event in self.events[cursor:] if event.WhichOneof("content") in wanted
                     and (not request.axes or event.axis in request.axes)]
            cursor = len(self.events)
            if batch or not greeted:
                yield event_pb.WatchEventsResponse(instance_id="fake", events=batch, cursor=cursor, newest=cursor)
            greeted = True
            await asyncio.sleep(0.01)


SERVICES = (drive_rpc.add_DriveServiceServicer_to_server, event_rpc.add_EventServiceServicer_to_server)
