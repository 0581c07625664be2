"""What the buses can promise, and what was seen. Times are in seconds; None: without bound, or not seen yet."""
from __future__ import annotations

import dataclasses
from typing import Any

from .v1 import budget_pb2


def _seconds(raw: Any, field: str) -> float | None:
    return getattr(raw, field).ToNanoseconds() / 1e9 if raw.HasField(field) else None


@dataclasses.dataclass(frozen=True)
class StopBudget:
    """A stop of `axes` axes at once: to the last byte of the last frame, and to the confirmed standstill of all, beyond
    their deceleration times."""
    axes: int
    last_frame: float | None
    standstill: float | None

    @classmethod
    def of(cls, raw: budget_pb2.StopBudget) -> StopBudget:
        return cls(raw.axes, _seconds(raw, "last_frame"), _seconds(raw, "standstill"))


@dataclasses.dataclass(frozen=True)
class AxisBudget:
    """Worst cases of one axis; `seen_*` are the longest since the daemon started. `way_alone` and `way_all` are in
    `unit`, from the stop request on at the highest velocity; infinite where that stop has no bound."""
    axis: str
    refresh_idle: float | None
    refresh_moving: float | None
    refresh_moving_all: float | None
    stop_alone: StopBudget
    stop_all: StopBudget
    deceleration_time: float
    way_alone: float
    way_all: float
    unit: str
    seen_refresh_idle: float | None
    seen_refresh_moving: float | None
    seen_stop_frame: float | None
    seen_standstill: float | None
    seen_stop_frame_all: float | None
    seen_standstill_all: float | None

    @classmethod
    def of(cls, raw: budget_pb2.AxisBudget) -> AxisBudget:
        seen = (_seconds(raw.observed, field) for field in (
            "refresh_idle", "refresh_moving", "stop_frame", "standstill", "stop_frame_all", "standstill_all"))
        return cls(raw.axis, _seconds(raw, "refresh_idle"), _seconds(raw, "refresh_moving"),
                   _seconds(raw, "refresh_moving_all"), StopBudget.of(raw.stop_alone), StopBudget.of(raw.stop_all),
                   _seconds(raw, "deceleration_time") or 0.0, raw.way_alone, raw.way_all, raw.unit, *seen)


@dataclasses.dataclass(frozen=True)
class BusBudget:
    """What one bus can promise. `utilisation` is that with 0, 1, ... all axes moving; `excess` says what the
    configuration demands and the bus does not meet."""
    bus: str
    utilisation: tuple[float, ...]
    stops: tuple[StopBudget, ...]
    axes: tuple[AxisBudget, ...]
    excess: tuple[str, ...]
    notes: tuple[str, ...]
    raw: budget_pb2.BusBudget = dataclasses.field(repr=False, compare=False)

    @classmethod
    def of(cls, raw: budget_pb2.BusBudget) -> BusBudget:
        return cls(raw.bus, tuple(load.utilisation for load in raw.load), tuple(map(StopBudget.of, raw.stops)),
                   tuple(map(AxisBudget.of, raw.axes)), tuple(one.message for one in raw.excess), tuple(raw.notes), raw)
