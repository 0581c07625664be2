#include "devices/yako_rtu/simulator_position.hpp"

namespace axisd::yako_rtu {

namespace {

/// Where it was read longer ago the carry was not in between.
constexpr auto just_now = std::chrono::milliseconds(250);
/// Nor where it was longer ago than a drive takes from one word to the next: pulses, of 200 kHz in 1 ms.
constexpr int near_carry = 200;

}  // namespace

void PositionWords::power_up() {
  shaft_->motor().power_up();
  high_read_.reset();
}

void PositionWords::clear() {
  shaft_->motor().clear_counter();
  high_read_.reset();  // no carry
}

std::uint16_t PositionWords::read_high(std::int32_t position, TimePoint now) {
  const auto bits = static_cast<std::uint32_t>(position);
  const auto high = static_cast<std::uint16_t>(bits >> 16U);
  const auto low = static_cast<std::int16_t>(bits & 0xFFFFU);
  const auto before = std::exchange(high_read_, std::pair(high, now));
  const bool carries = -near_carry <= low && low < near_carry;
  const bool torn = behaviour_->position_words_torn && carries && before && now - before->second <= just_now;
  return torn ? before->first : high;
}

}  // namespace axisd::yako_rtu
