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
/// Between the two words, at most.
constexpr Duration word_time = std::chrono::milliseconds(1);

}  // namespace

bool TornPosition::suspects(std::int32_t position, TimePoint measured_at) const {
  const auto known = believed_.value_or(Believed{.asked_at = measured_at});
  // Right also where the 32-bit counter wrapped in between.
  const auto step = static_cast<std::int32_t>(static_cast<std::uint32_t>(position) -
                                              static_cast<std::uint32_t>(known.position));
  const auto way = std::abs(static_cast<double>(step));
  const auto reach = rate_margin * highest_rate_ * in_seconds(measured_at - known.asked_at) + waver;
  // At rest it may have gone there since the last reading, or not at all: how long ago that was says nothing.
  const auto low = static_cast<double>(static_cast<std::uint32_t>(position) & 0xFFFFU);
  const auto edge = waver + highest_rate_ * in_seconds(word_time);
  const bool at_carry = (low <= edge || low >= carry - edge) && std::abs(way - carry) <= edge;
  return at_carry || (way > reach && std::abs(way - carry) <= reach);
}

void TornPosition::believe(std::int32_t position, TimePoint asked_at) {
  believed_ = {.position = position, .asked_at = asked_at};
}

std::int32_t TornPosition::of_two(std::int32_t suspect, std::int32_t second) {
  const auto apart =
      static_cast<std::int32_t>(static_cast<std::uint32_t>(second) - static_cast<std::uint32_t>(suspect));
  constexpr std::uint32_t one = 0x10000;
  if (std::abs(std::abs(static_cast<double>(apart)) - 2 * carry) > carry / 2) return second;
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(second) + (apart > 0 ? 0U - one : one));
}

}  // namespace axisd::yako_rtu
