#include "devices/cia402_eds/simulator_units.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace axisd::cia402_eds {

namespace {

using simulation::CanopenDictionary;
using simulation::UnitSettings;

constexpr double minute = 60, degrees = 360;

// CiA 303-2, as bytes of an SI unit; r/min is what maxon's drives say in 60AAh.
constexpr unsigned second = 0x03, radian = 0x10, degree = 0x41, minute_unit = 0x47, second_squared = 0x57,
                   rpm_unit = 0xC0, revolution = 0xB4, increment = 0xB5;
// Dimension indices.
constexpr std::int64_t degree_index = 0x41, rpm_index = 0xA4, revolution_per_second_squared_index = 0xAF;

/// Of the range that CiA 303-2 has prefixes for, so that nothing overflows.
double power_of_ten(std::int64_t exponent) {
  return std::pow(10.0, static_cast<double>(std::clamp<std::int64_t>(exponent, -9, 9)));
}

struct SiUnit {
  double factor;
  unsigned numerator, denominator;
};

/// Nothing: the drive has none, or it is 0 (not said).
std::optional<SiUnit> si_unit(const CanopenDictionary& dictionary, std::uint16_t index) {
  const auto bits = static_cast<std::uint32_t>(dictionary.get(index));
  if (bits == 0) return std::nullopt;
  return SiUnit{.factor = power_of_ten(static_cast<std::int8_t>(bits >> 24U)),
                .numerator = bits >> 16U & 0xFFU,
                .denominator = bits >> 8U & 0xFFU};
}

// One byte each, notation with a sign, whatever type the file gives them.
double notation(const CanopenDictionary& dictionary, std::uint16_t index) {
  return power_of_ten(static_cast<std::int8_t>(dictionary.get(index)));
}
std::int64_t dimension(const CanopenDictionary& dictionary, std::uint16_t index) {
  return dictionary.get(index) & 0xFF;
}

/// So much in a revolution, by two numbers of the same object; nothing: it has none, or as templates have it.
std::optional<double> per_revolution(const CanopenDictionary& dictionary, std::uint16_t index) {
  const auto counts = static_cast<double>(dictionary.get(index, 1));
  const auto revolutions = static_cast<double>(dictionary.get(index, 2));
  if (counts <= revolutions || revolutions <= 0) return std::nullopt;
  return counts / revolutions;
}

/// Counts of the encoder per revolution.
double encoder_of(const CanopenDictionary& dictionary, const UnitSettings& settings) {
  return per_revolution(dictionary, 0x608F).value_or(settings.counts_per_revolution);
}

/// Revolutions of the shaft in one of an angle's units.
std::optional<double> turns_of(unsigned unit, double encoder) {
  switch (unit) {
    case degree:
      return 1 / degrees;
    case radian:
      return 1 / (2 * std::numbers::pi);
    case revolution:
      return 1;
    case increment:
      return 1 / encoder;
    default:
      return std::nullopt;
  }
}

/// What a position factor (6093h) makes of a revolution depends on its maker: it is as many counts as is
/// meant.
bool has_position_factor(const CanopenDictionary& dictionary) {
  const auto feed = dictionary.get(0x6093, 1), counts = dictionary.get(0x6093, 2);
  return feed > 0 && counts > 0 && feed != counts;
}

double position_of(const CanopenDictionary& dictionary, const UnitSettings& settings, double encoder) {
  if (const auto unit = si_unit(dictionary, 0x60A8))
    if (const auto turns = turns_of(unit->numerator, encoder)) return unit->factor * *turns;
  if (dimension(dictionary, 0x608A) == degree_index) return notation(dictionary, 0x6089) / degrees;
  if (has_position_factor(dictionary)) return 1 / settings.counts_per_revolution;
  return 1 / per_revolution(dictionary, 0x6092).value_or(encoder);  // the feed of a revolution
}

std::optional<double> told_velocity(const CanopenDictionary& dictionary, double encoder) {
  if (const auto unit = si_unit(dictionary, 0x60A9)) {
    const auto turns = turns_of(unit->numerator, encoder);
    if (turns && unit->denominator == second) return unit->factor * *turns;
    if (turns && unit->denominator == minute_unit) return unit->factor * *turns / minute;
  }
  if (dimension(dictionary, 0x608C) == rpm_index) return notation(dictionary, 0x608B) / minute;
  return std::nullopt;
}

double of_settings(simulation::RateUnit unit, double position) {
  return unit.revolutions > 0 ? unit.revolutions : position;
}

std::optional<double> told_acceleration(const CanopenDictionary& dictionary, double encoder) {
  if (const auto unit = si_unit(dictionary, 0x60AA)) {
    if (unit->numerator == rpm_unit && unit->denominator == second) return unit->factor / minute;
    const auto turns = turns_of(unit->numerator, encoder);
    if (turns && unit->denominator == second_squared) return unit->factor * *turns;
  }
  const auto index = dimension(dictionary, 0x608E);
  if (index == rpm_index) return notation(dictionary, 0x608D) / minute;  // and per second
  if (index == revolution_per_second_squared_index) return notation(dictionary, 0x608D);
  return std::nullopt;
}

}  // namespace

ShaftUnits units_of(const CanopenDictionary& dictionary, const UnitSettings& settings) {
  const auto encoder = encoder_of(dictionary, settings);
  const auto position = position_of(dictionary, settings, encoder);
  const auto velocity = told_velocity(dictionary, encoder).value_or(of_settings(settings.velocity, position));
  const auto otherwise = settings.acceleration ? of_settings(*settings.acceleration, position) : velocity;
  return {.position = position,
          .velocity = velocity,
          .acceleration = told_acceleration(dictionary, encoder).value_or(otherwise)};
}

bool says_rates(std::uint16_t index) {
  return index == 0x60A9 || index == 0x60AA || (index >= 0x608B && index <= 0x608E);
}

}  // namespace axisd::cia402_eds
