"""What goes over a bus, as plain immutable values. Each keeps the message that it came from as `raw`."""
from __future__ import annotations

import dataclasses
import datetime
import math

from .types import BusKind, _member, _optional_time, seconds
from .v1 import bus_service_pb2


@dataclasses.dataclass(frozen=True)
class Latency:
    """How long something took, as buckets: `counts[i]` is how often at most 0.1 ms * 2^(i/4)."""
    counts: tuple[int, ...]
    longest: float

    def percentile(self, share: float) -> float:
        """What `share` (0 to 1) of all took at most, in seconds, up to 19 % too high; 0 of nothing."""
        wanted = max(1, math.ceil(share * sum(self.counts)))
        for bucket, total in enumerate(self.counts[:69]):
            wanted -= total
            if wanted <= 0:
                return min(0.1e-3 * 2 ** (bucket / 4), self.longest)
        return self.longest

    @classmethod
    def of(cls, raw: bus_service_pb2.LatencyHistogram) -> Latency:
        return cls(tuple(raw.counts), seconds(raw.longest))


@dataclasses.dataclass(frozen=True)
class ClassStatistics:
    """One class of what waits for a bus ("stop", "motion" ...); how many were dropped by which cause is in `raw`."""
    transaction_class: str
    sent: int
    waiting: int
    most_waiting: int
    queueing: Latency
    exchange: Latency
    raw: bus_service_pb2.ClassStatistics = dataclasses.field(repr=False, compare=False)

    @classmethod
    def of(cls, raw: bus_service_pb2.ClassStatistics) -> ClassStatistics:
        return cls(_class_name(raw.transaction_class), raw.sent, raw.waiting, raw.most_waiting, Latency.of(raw.queueing),
                   Latency.of(raw.exchange), raw)


@dataclasses.dataclass(frozen=True)
class Quarantine:
    """A node of a line that does not answer is asked with growing waits. `active`: now, for `lasting` seconds, with
    `probes` in vain and the next one in `next_probe_in` seconds. `times`: that it was put there."""
    active: bool
    lasting: float
    next_probe_in: float
    probes: int
    times: int

    @classmethod
    def of(cls, raw: bus_service_pb2.Quarantine) -> Quarantine:
        return cls(raw.active, seconds(raw.lasting), seconds(raw.next_probe_in), raw.probes, raw.times)


@dataclasses.dataclass(frozen=True)
class UnknownOutcomes:
    """Starts whose frame got no reply, by what reading the drive back showed."""
    executed: int
    not_executed: int
    unresolved: int

    @classmethod
    def of(cls, raw: bus_service_pb2.UnknownOutcomes) -> UnknownOutcomes:
        return cls(raw.executed, raw.not_executed, raw.unresolved)


@dataclasses.dataclass(frozen=True)
class NodeStatistics:
    """One node: `timeouts` are those of exchanges or of SDO transfers; all counters are in `raw`."""
    node: int
    name: str
    timeouts: int
    quarantine: Quarantine
    unknown_starts: UnknownOutcomes
    raw: bus_service_pb2.NodeStatistics = dataclasses.field(repr=False, compare=False)

    @classmethod
    def of(cls, raw: bus_service_pb2.NodeStatistics) -> NodeStatistics:
        return cls(raw.node, raw.name, raw.network.sdo_timeouts if raw.HasField("network") else raw.line.timeouts,
                   Quarantine.of(raw.line.quarantine), UnknownOutcomes.of(raw.unknown_starts), raw)


@dataclasses.dataclass(frozen=True)
class BusStatistics:
    """Since the daemon started, `utilisation` (0 to 1) of the last 10 seconds. `classes` are those of a line, and so is
    `held_back`: requests that wait for the next probe of a node in quarantine."""
    bus: str
    kind: BusKind
    since_start: float
    utilisation: float
    utilisation_since_start: float
    classes: dict[str, ClassStatistics]
    nodes: dict[int, NodeStatistics]
    held_back: int
    raw: bus_service_pb2.BusStatistics = dataclasses.field(repr=False, compare=False)

    @classmethod
    def of(cls, raw: bus_service_pb2.BusStatistics) -> BusStatistics:
        classes = [ClassStatistics.of(one) for one in raw.classes]
        return cls(raw.bus, _member(BusKind, bus_service_pb2.BusKind.DESCRIPTOR, "BUS_KIND_", raw.kind),
                   seconds(raw.since_start), raw.utilisation, raw.utilisation_since_start,
                   {one.transaction_class: one for one in classes},
                   {node.node: NodeStatistics.of(node) for node in raw.nodes}, raw.held_back, raw)


@dataclasses.dataclass(frozen=True)
class TracedFrame:
    """`kind`: "sent", "received", "not_sent", "failed" or "link"; `why` of the last three. `data` has the CRC of an RTU
    frame; the identifier of a CAN frame is in `raw.can`. `lost`: frames before this one that the reader was too slow for."""
    sequence: int
    monotonic_ns: int
    at: datetime.datetime | None
    kind: str
    transaction_class: str
    node: int
    data: bytes
    why: str
    text: str
    lost: int
    raw: bus_service_pb2.TracedFrame = dataclasses.field(repr=False, compare=False)

    @classmethod
    def of(cls, raw: bus_service_pb2.TracedFrame, lost: int) -> TracedFrame:
        kind = bus_service_pb2.TraceKind.DESCRIPTOR.values_by_number.get(raw.kind)
        return cls(raw.sequence, raw.monotonic_ns, _optional_time(raw, "at"),
                   kind.name.removeprefix("TRACE_KIND_").lower() if kind else str(raw.kind),
                   _class_name(raw.transaction_class), raw.node, raw.data, raw.why, raw.text, lost, raw)


@dataclasses.dataclass(frozen=True)
class FlightRecord:
    """The newest frames of a bus, as they were when something went wrong."""
    name: str
    bus: str
    reason: str
    written_at: datetime.datetime | None
    size: int

    @classmethod
    def of(cls, raw: bus_service_pb2.FlightRecord) -> FlightRecord:
        return cls(raw.name, raw.bus, raw.reason, _optional_time(raw, "written_at"), raw.size)


def _class_name(number: int) -> str:
    """Empty: none, or one that this package does not know."""
    value = bus_service_pb2.TransactionClass.DESCRIPTOR.values_by_number.get(number)
    return value.name.removeprefix("TRANSACTION_CLASS_").lower() if value is not None and number else ""
