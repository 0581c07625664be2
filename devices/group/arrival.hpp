#pragma once

#include <cstdint>
#include <vector>

#include "devices/axis/planner.hpp"

namespace axisd {

/// One axis's way, for a common arrival.
struct Arrival {
  const Planner* planner = nullptr;
  Plan plan{};
  std::int64_t pulses = 0;  ///< from where it stands to the target, signed; 0: it does not move
};

/// Slows the faster ones down, so that all take as long as the slowest does. Pure.
void arrive_together(std::vector<Arrival>& arrivals);

/// Between the shortest and the longest duration of those that move.
[[nodiscard]] Duration arrival_error(const std::vector<Duration>& durations);

}  // namespace axisd
