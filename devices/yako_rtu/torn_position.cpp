#include "devices/yako_rtu/torn_position.hpp"

#include <cmath>
#include <cstdlib>

#include "buses/seconds.hpp"

namespace axisd::yako_rtu {

namespace {

/// What a carry between the words adds or takes.
constexpr double carry = 65536;
/// A drive's clock is its own, and a measured position wavers.
constexpr double rate_margin = 1.1, waver = 100;

}  // namespace

bool TornPosition::suspects(std::int32_t position, TimePoint measured_at) const {
  if (!believed_) return false;
  // Right also where the 32-bit counter wrapped in between.
  const auto step = static_cast<std::int32_t>(static_cast<std::uint32_t>(position) -
                                              static_cast<std::uint32_t>(believed_->position));
  const auto way = std::abs(static_cast<double>(step));
  const auto reach = rate_margin * highest_rate_ * in_seconds(measured_at - believed_->asked_at) + waver;
  return way > reach && std::abs(way - carry) <= reach;
}

void TornPosition::believe(std::int32_t position, TimePoint asked_at) {
  believed_ = {.position = position, .asked_at = asked_at};
}

}  // namespace axisd::yako_rtu
