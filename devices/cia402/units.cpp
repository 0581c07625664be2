#include "devices/cia402/units.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <utility>

#include "devices/cia402/ratios.hpp"

namespace axisd::cia402 {

namespace {

constexpr std::int64_t most_counts = std::numeric_limits<std::int32_t>::max();
constexpr std::int64_t most_pulse_rate = 1'000'000'000'000;

std::int32_t whole(Wide value) { return static_cast<std::int32_t>(saturated(value, most_counts)); }

/// r/min of one count.
Ratio rpm_per_count(Rate unit, std::int64_t pulses_per_revolution) {
  auto ratio = revolutions_of(unit.angle, pulses_per_revolution);
  if (unit.per == Per::second) ratio.numerator *= 60;
  const auto exponent = std::clamp<int>(unit.exponent, -largest_exponent, largest_exponent);
  (exponent < 0 ? ratio.denominator : ratio.numerator) *= power_of_ten(std::abs(exponent));
  return ratio;
}

constexpr int named_powers = 4;  // 10^0 to 10^-3
constexpr std::array named_bases{revolutions_per_minute,
                                 Rate{.angle = Angle::revolution, .per = Per::second, .exponent = 0},
                                 Rate{.angle = Angle::degree, .per = Per::second, .exponent = 0},
                                 Rate{.angle = Angle::radian, .per = Per::second, .exponent = 0}};
static_assert(unit_names.size() == 1 + named_bases.size() * named_powers);

/// In the order of unit_names.
Rate unit_at(std::size_t number) {
  if (number == 0) return pulses_per_second;
  auto unit = named_bases.at((number - 1) / named_powers);
  unit.exponent = static_cast<std::int8_t>(-static_cast<int>((number - 1) % named_powers));
  return unit;
}

}  // namespace

Ratio revolutions_of(Angle angle, std::int64_t pulses_per_revolution) {
  constexpr std::int64_t pi_numerator = 245'850'922, pi_denominator = 78'256'779, degrees = 360;
  switch (angle) {
    case Angle::pulse:
      return {1, std::clamp<std::int64_t>(pulses_per_revolution, 1, most_counts)};
    case Angle::revolution:
      break;
    case Angle::degree:
      return {1, degrees};
    case Angle::radian:
      return {pi_denominator, 2 * pi_numerator};
  }
  return {};
}

std::string text_of(Rate unit) {
  static constexpr std::string_view angles[] = {"pulses", "r", "degrees", "rad"};
  std::string factor;
  if (unit.exponent > 0) factor = "1" + std::string(static_cast<std::size_t>(unit.exponent), '0') + " ";
  if (unit.exponent < 0)
    factor = "0." + std::string(static_cast<std::size_t>(-unit.exponent - 1), '0') + "1 ";
  return fmt::format("{}{}/{}", factor, angles[std::to_underlying(unit.angle)],
                     unit.per == Per::second ? "s" : "min");
}

std::optional<Rate> unit_named(std::string_view name) {
  const auto found = std::ranges::find(unit_names, name);
  if (found == unit_names.end()) return std::nullopt;
  return unit_at(static_cast<std::size_t>(found - unit_names.begin()));
}

std::string_view name_of(Rate unit) {
  for (std::size_t i = 0; i < unit_names.size(); ++i)
    if (unit_at(i) == unit) return unit_names.at(i);
  return {};
}

std::int32_t counts_of(Rate unit, std::int64_t pulses_per_revolution, int rpm) {
  const auto ratio = rpm_per_count(unit, pulses_per_revolution);
  return whole(rpm * ratio.denominator / ratio.numerator);
}

std::int32_t rpm_of(Rate unit, std::int64_t pulses_per_revolution, std::int64_t counts) {
  const auto ratio = rpm_per_count(unit, pulses_per_revolution);
  return whole(nearest(counts * ratio.numerator, ratio.denominator));
}

std::int32_t ramp_of(Rate unit, std::int64_t pulses_per_revolution, int rpm, Duration time, RampUse use) {
  constexpr Duration shortest = std::chrono::milliseconds(1), longest = std::chrono::hours(24);
  constexpr std::int64_t second = std::chrono::nanoseconds(std::chrono::seconds(1)).count();
  const auto ratio = rpm_per_count(unit, pulses_per_revolution);
  const Wide speed = std::abs(std::int64_t{rpm}) * ratio.denominator * second;
  const Wide per_count = ratio.numerator * std::clamp(time, shortest, longest).count();
  const Wide counts = (speed + (use == RampUse::brake ? per_count - 1 : 0)) / per_count;
  return std::max(1, whole(counts));
}

Duration time_of_ramp(Rate unit, std::int64_t pulses_per_revolution, int rpm, std::int64_t counts) {
  constexpr Duration longest = std::chrono::hours(24);
  constexpr std::int64_t second = std::chrono::nanoseconds(std::chrono::seconds(1)).count();
  const auto ratio = rpm_per_count(unit, pulses_per_revolution);
  const Wide speed = std::abs(std::int64_t{rpm}) * ratio.denominator * second;
  const Wide per_second = ratio.numerator * std::max<std::int64_t>(counts, 1);
  return Duration(saturated((speed + per_second - 1) / per_second, longest.count()));
}

double rpm_of_count(Rate unit) {
  const auto ratio = rpm_per_count(unit, 1);
  return static_cast<double>(ratio.numerator) / static_cast<double>(ratio.denominator);
}

std::int32_t fastest_rpm(Rate unit, std::int64_t counts) {
  const auto ratio = rpm_per_count(unit, 1);
  return whole(std::max<std::int64_t>(0, counts) * ratio.numerator / ratio.denominator);
}

std::int32_t slowest_rpm(Rate unit) {
  const auto ratio = rpm_per_count(unit, 1);
  if (ratio.denominator % ratio.numerator == 0) return 1;  // whole r/min are whole counts
  constexpr int least_counts = 5;
  return whole((least_counts * ratio.numerator + ratio.denominator - 1) / ratio.denominator);
}

std::int64_t fastest_pulse_rate(Rate unit, std::int64_t counts) {
  // A pulse per second is 60 r/min of one pulse per revolution.
  const auto ratio = rpm_per_count(unit, 1);
  return saturated(std::max<std::int64_t>(0, counts) * ratio.numerator / (60 * ratio.denominator),
                   most_pulse_rate);
}

}  // namespace axisd::cia402
