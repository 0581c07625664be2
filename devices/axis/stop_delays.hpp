#pragma once

#include "buses/latency_histogram.hpp"

namespace axisd {

/// How long the stops on one bus took, of each axis that was stopped: from the request's arrival at the
/// server. Those that an axis decided on itself are not counted.
struct StopDelays {
  struct Scope {
    LatencyHistogram frame;       ///< to the last byte of its first stop frame, answered or not
    LatencyHistogram standstill;  ///< to the confirmed standstill
  };
  Scope some;  ///< of one axis, or of some
  Scope all;   ///< of all axes
  [[nodiscard]] Scope& of(bool all_axes) { return all_axes ? all : some; }
};

}  // namespace axisd
