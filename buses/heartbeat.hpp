// How often a thread shows that it lives.
#pragma once

#include "buses/clock.hpp"

namespace axisd {

/// Longest that a loop sleeps which the watchdog looks at: four times shorter than the shortest stall that it
/// takes for death (buses/supervision.hpp), so that a loop which is woken late is none.
inline constexpr Duration heartbeat = std::chrono::milliseconds(200);

}  // namespace axisd
