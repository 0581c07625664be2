// The families of metrics, by what they are about. Each is written whether or not it has a sample.
#pragma once

#include <vector>

#include "api/exposition/exposition.hpp"
#include "daemon/core/meter.hpp"
#include "devices/bus_access.hpp"

namespace axisd::metrics {

/// `now`: of the clock that the samples' times are of.
void write_axes(Exposition& to, const std::vector<AxisSnapshotPtr>& axes, const core::Tallies& tallies,
                TimePoint now);
void write_devices(Exposition& to, const std::vector<DeviceSnapshotPtr>& devices);

}  // namespace axisd::metrics
