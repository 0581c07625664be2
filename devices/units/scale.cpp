#include "devices/units/scale.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "devices/units/exact_scale.hpp"

namespace axisd {

namespace {

using Integer = boost::multiprecision::cpp_int;

constexpr auto smallest = std::numeric_limits<std::int64_t>::min();
constexpr auto largest = std::numeric_limits<std::int64_t>::max();

/// Unsigned pulses per user unit. Precondition: all parts are positive.
Exact magnitude(const ScaleSettings& settings) {
  const Integer numerator =
      Integer(settings.pulses_per_revolution) * settings.gear_motor * settings.travel_denominator;
  const Integer denominator = Integer(settings.gear_output) * settings.travel_numerator;
  return {numerator, denominator};
}

std::int64_t to_int64(const Integer& value) { return value.convert_to<std::int64_t>(); }

Integer round_half_away(const Exact& value) {
  const Integer numerator_of = numerator(value), denominator_of = denominator(value);
  const Integer doubled = 2 * abs(numerator_of) + denominator_of;  // |value| + 1/2, over 2 * denominator
  const Integer rounded = doubled / (2 * denominator_of);
  return numerator_of < 0 ? Integer(-rounded) : rounded;
}

}  // namespace

bool Scale::valid(const ScaleSettings& settings) {
  if (settings.pulses_per_revolution <= 0 || settings.gear_motor <= 0 || settings.gear_output <= 0 ||
      settings.travel_numerator <= 0 || settings.travel_denominator <= 0) {
    return false;
  }
  const Exact ratio = magnitude(settings);
  using boost::multiprecision::denominator, boost::multiprecision::numerator;
  return numerator(ratio) <= largest && denominator(ratio) <= largest;
}

Scale::Scale(ScaleSettings settings) : settings_(std::move(settings)) {
  if (!valid(settings_))
    throw std::invalid_argument("scale: every ratio must be positive and fit into 63 bit");
  const Exact ratio = magnitude(settings_);
  numerator_ = to_int64(boost::multiprecision::numerator(ratio));
  denominator_ = to_int64(boost::multiprecision::denominator(ratio));
  if (settings_.invert) numerator_ = -numerator_;
}

double Scale::pulses_per_unit() const {
  return static_cast<double>(static_cast<long double>(numerator_) / static_cast<long double>(denominator_));
}

double Scale::to_units(std::int64_t pulses) const {
  // Called for every sample: long double (64-bit mantissa) instead of a rational. Two roundings of 2^-64
  // before the final one to double, so that to_pulses() gives back what to_units() was given (see the test).
  return static_cast<double>(static_cast<long double>(pulses) * static_cast<long double>(denominator_) /
                             static_cast<long double>(numerator_));
}

std::optional<std::int64_t> Scale::checked_pulses(double units) const {
  const auto exact = to_exact(units);
  return exact ? axisd::to_pulses(*this, *exact) : std::nullopt;
}

std::int64_t Scale::to_pulses(double units) const {
  if (std::isnan(units)) return 0;
  if (const auto pulses = checked_pulses(units)) return *pulses;
  return (units > 0) == (numerator_ > 0) ? largest : smallest;
}

double Scale::velocity_to_units(double rpm) const {
  return rpm / 60 * static_cast<double>(settings_.pulses_per_revolution) / pulses_per_unit();
}

double Scale::velocity_to_rpm(double units_per_second) const {
  return units_per_second * pulses_per_unit() / static_cast<double>(settings_.pulses_per_revolution) * 60;
}

std::optional<Exact> to_exact(double value) {
  if (!std::isfinite(value)) return std::nullopt;
  return Exact(value);
}

Exact to_exact_units(const Scale& scale, std::int64_t pulses) {
  return Exact(Integer(pulses)) * Exact(Integer(scale.denominator()), Integer(scale.numerator()));
}

std::optional<std::int64_t> to_pulses(const Scale& scale, const Exact& units) {
  const Integer pulses =
      round_half_away(units * Exact(Integer(scale.numerator()), Integer(scale.denominator())));
  if (pulses < smallest || pulses > largest) return std::nullopt;
  return to_int64(pulses);
}

}  // namespace axisd
