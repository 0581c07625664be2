// Arithmetic of conversions that are rounded once. Pure.
#pragma once

#include <algorithm>
#include <cstdint>

#include "devices/cia402/units.hpp"

namespace axisd::cia402 {

/// Holds every product of a conversion: they stay below 2^124.
__extension__ using Wide = __int128;

constexpr Wide power_of_ten(int exponent) {
  Wide power = 1;
  for (int i = 0; i < exponent; ++i) power *= 10;
  return power;
}
constexpr std::int64_t saturated(Wide value, std::int64_t most) {
  return static_cast<std::int64_t>(std::clamp<Wide>(value, -Wide{most}, Wide{most}));
}
/// Half away from 0. Precondition: denominator > 0.
constexpr Wide nearest(Wide numerator, Wide denominator) {
  const auto half = denominator / 2;
  return (numerator < 0 ? numerator - half : numerator + half) / denominator;
}

/// Positive.
struct Ratio {
  Wide numerator = 1, denominator = 1;
};
/// Revolutions of one `angle`; of a radian within 3 * 10^-17 of its value.
Ratio revolutions_of(Angle angle, std::int64_t pulses_per_revolution);

}  // namespace axisd::cia402
