"""Answers that a daemon with simulated drives does not give when a test wants them, and whose figures a test knows."""
from between import Open  # makes axisd importable
from google.protobuf import duration_pb2
from axisd.v1 import (axis_service_pb2 as axis_pb, budget_pb2 as budget_pb, bus_service_pb2 as bus_pb, drive_service_pb2 as drive_pb, error_pb2,
                      event_service_pb2 as event_pb, group_service_pb2 as group_pb, system_service_pb2 as system_pb, types_pb2)

BUSES = bus_pb.ListBusesResponse(buses=[
    bus_pb.Bus(name="line-a", port="sim", baud=115200, open=True, simulated=True, transactions=1234),
    bus_pb.Bus(name="line-b", port="/dev/ttyUSB7", baud=9600, error=error_pb2.ErrorDetail(
        reason=error_pb2.REASON_BUS_DOWN, message="/dev/ttyUSB7: No such file or directory", remedy="check the adapter")),
    bus_pb.Bus(name="can0", port="can0", baud=500000, kind=bus_pb.BUS_KIND_CANOPEN, open=True, network=bus_pb.NetworkStatus(
        link=bus_pb.NETWORK_LINK_ERROR_PASSIVE, frames_sent=1001, frames_received=2002, frames_not_sent=3, frames_unknown=4,
        sdo_transfers=505, sdo_aborts=6, sdo_timeouts=7, sync_period=duration_pb2.Duration(nanos=10000000),
        sync_running=True, sync_sent=808, sync_missed=9, emergencies=10, foreign_nodes=[22, 23], foreign_frames=11,
        link_helper_error=error_pb2.ErrorDetail(reason=error_pb2.REASON_BUS_DOWN, message="there is no link helper",
                                                remedy="enable axisd-link.socket")))])

NOT_HEEDED = system_pb.GetInfoResponse(machine="press-1", version="0.1.0", client="unix:anna", identity="unix:anna",
                                       role="ROLE_OPERATOR")

BUDGET = bus_pb.GetBudgetResponse(budgets=[budget_pb.BusBudget(
    bus="line-a", load=[budget_pb.LoadBudget(utilisation=0.25, utilisation_max=0.5,
                                             refresh_idle=duration_pb2.Duration(nanos=300000000))],
    stops=[budget_pb.StopBudget(axes=1, last_frame=duration_pb2.Duration(nanos=28000000))],
    axes=[budget_pb.AxisBudget(
        axis="feeder", unit="mm", way_alone=10.5, deceleration_time=duration_pb2.Duration(nanos=150000000),
        stop_alone=budget_pb.StopBudget(axes=1, last_frame=duration_pb2.Duration(nanos=28000000)),
        observed=budget_pb.ObservedTimes(stop_frame=duration_pb2.Duration(nanos=7000000)))],
    excess=[budget_pb.BudgetExcess(key="stop_bound", message="too late", remedy="raise it")], notes=["a note"])])

GROUPS = group_pb.ListGroupsResponse(groups=[group_pb.Group(name="transfer", axes=["feeder", "elsewhere"])])


def _statistics():
    line = bus_pb.BusStatistics(bus="line-a", kind=bus_pb.BUS_KIND_MODBUS_RTU, utilisation=0.25, held_back=3, classes=[
        bus_pb.ClassStatistics(transaction_class=bus_pb.TRANSACTION_CLASS_MOTION, sent=10, dropped_superseded=2,
                               queueing=bus_pb.LatencyHistogram(counts=[5, 5]))], nodes=[
        bus_pb.NodeStatistics(node=1, name="feeder", line=bus_pb.LineNodeStatistics(
            replies=9, timeouts=1, quarantine=bus_pb.Quarantine(active=True, probes=4, times=1)),
            unknown_starts=bus_pb.UnknownOutcomes(executed=2))])
    line.nodes[0].line.quarantine.lasting.FromSeconds(75)
    line.nodes[0].line.quarantine.next_probe_in.FromMilliseconds(250)
    line.since_start.FromSeconds(60)
    line.classes[0].queueing.longest.FromMicroseconds(110)
    return [line, bus_pb.BusStatistics(bus="can0", kind=bus_pb.BUS_KIND_CANOPEN, nodes=[
        bus_pb.NodeStatistics(node=5, network=bus_pb.NetworkNodeStatistics(sdo_timeouts=3, tpdos=40))])]


STATISTICS = bus_pb.GetBusStatisticsResponse(buses=_statistics())
WATCHED_STATISTICS = Open([bus_pb.WatchBusStatisticsResponse(buses=_statistics())] * 3)


def _trace():
    sent = bus_pb.TracedFrame(sequence=7, monotonic_ns=5, kind=bus_pb.TRACE_KIND_SENT, node=5,
                              transaction_class=bus_pb.TRANSACTION_CLASS_STOP, data=b"\x40\x41\x60\0\0\0\0\0",
                              can=bus_pb.CanIdentifier(id=0x605, length=8), text="5 can0 tx 605#4041600000000000")
    sent.at.FromNanoseconds(1_700_000_000_123_456_789)
    link = bus_pb.TracedFrame(sequence=8, monotonic_ns=6, kind=bus_pb.TRACE_KIND_LINK, why="bus_off", text="6 can0 link bus_off")
    return Open([bus_pb.TraceBusResponse(), bus_pb.TraceBusResponse(frames=[sent], lost=3),
                 bus_pb.TraceBusResponse(frames=[link])])


TRACE = _trace()
FLIGHT_RECORDS = bus_pb.ListFlightRecordsResponse(records=[bus_pb.FlightRecord(
    name="line-a-1.wire", bus="line-a", reason="feeder: ErrorStop: alarm 2", size=77, written_at={"seconds": 1_700_000_000})])
RESTORED = drive_pb.RestoreFactoryResponse(after_power_cycle="node by its switches, 9600 8N1")


def changed(method, verified=False):
    """What Readdress and SetSerial tell one after the other."""
    response = getattr(drive_pb, f"{method}Response")
    told = [response(phase=drive_pb.SERIAL_PHASE_WRITTEN, text="SW1 to SW5 must be off")]
    if verified:
        told += [response(phase=drive_pb.SERIAL_PHASE_WAITING, text="looking for it"),
                 response(phase=drive_pb.SERIAL_PHASE_VERIFIED, text="it answers")]
    return told


_TURNTABLE = types_pb2.AxisState(axis="turntable", unit="deg", state=types_pb2.STATE_DISABLED, bus="line-a", node=2,
                                 link=types_pb2.LINK_STATE_ONLINE, model="ykd2405pr", drift="X1 has no function",
                                 eeprom_writes=12, moving=True, motion_cause=types_pb2.MOTION_CAUSE_TERMINAL)
DRIFTED = axis_pb.GetAxisResponse(state=_TURNTABLE)
LISTED = axis_pb.ListAxesResponse(axes=[_TURNTABLE])

_FOUND = (bus_pb.FoundNode(node=1, baud=115200, format="8N1", model="ykd2405pr", version="V1.0", pulses_per_revolution=10000,
                           configured_as="feeder"),
          bus_pb.FoundNode(node=5, baud=115200, format="8N1", model="ykd2405pr", version="V1.0", pulses_per_revolution=2000),
          bus_pb.FoundNode(node=8, baud=115200, format="8N1", note="garbled replies: two nodes on one address?"))
SCAN = [*(bus_pb.ScanResponse(probed=node.node, total=127, found=[node]) for node in _FOUND),
        bus_pb.ScanResponse(probed=127, total=127)]
SCAN_BEGUN = [bus_pb.ScanResponse(probed=1, total=127, found=[bus_pb.FoundNode(node=9, baud=9600, format="8N1")])]
CAN_SCAN = bus_pb.ScanResponse(probed=127, total=127, found=[
    bus_pb.FoundNode(node=5, baud=500000, model="ykd2405pr", device_type=0x40192, vendor=0x100, product=3,
                     pulses_per_revolution=4000),
    bus_pb.FoundNode(node=9, baud=500000, device_type=0x191, configured_as="valves"),
    bus_pb.FoundNode(node=22, baud=500000, note="it sends, but answers no SDO")])
REGISTERS = bus_pb.TransactResponse(values=[0xFFFF, 0xFFFE])
OBJECT = bus_pb.TransactResponse(data=b"\x37\x02", value=0x237)
DEVICES = bus_pb.ListDevicesResponse(devices=[bus_pb.Device(
    name="valves", bus="line-a", node=40, link=types_pb2.LINK_STATE_ONLINE,
    values=[bus_pb.DeviceValue(name="pressure", value=2.5, unit="bar", writable=True), bus_pb.DeviceValue(name="flow")])])
WRITTEN = bus_pb.WriteDeviceResponse(value=3.0)


def _events():
    edge = event_pb.TerminalEdge(terminal="X0", function="home", active=True)
    edge.after.FromMilliseconds(1000)
    edge.before.FromMilliseconds(1020)
    contents = (("feeder", {"state_change": {"from": types_pb2.STATE_STANDSTILL, "to": types_pb2.STATE_DISCRETE_MOTION,
                                             "cause": types_pb2.MOTION_CAUSE_TERMINAL}}),
                ("feeder", {"terminal_edge": edge}),
                ("ghost", {"link_change": {"to": types_pb2.LINK_STATE_OFFLINE, "detail": "no reply"}}),
                ("turntable", {"configuration_drift": {"text": "X1 has no function"}}))
    events = []
    for number, (axis, content) in enumerate(contents):
        events.append(event_pb.Event(sequence=number + 1, axis=axis, **content))
        events[-1].at.FromMilliseconds(1_700_000_000_123 + number)
    return event_pb.WatchEventsResponse(instance_id="canned", events=events, cursor=len(events), newest=len(events))


EVENTS = Open([_events()])
