#include "devices/cia402/unit_objects.hpp"

#include <fmt/format.h>

#include <array>
#include <cstdlib>
#include <limits>
#include <utility>

#include "devices/cia402/ratios.hpp"

namespace axisd::cia402 {

namespace {

using canopen::Object;

std::optional<std::int64_t> find(const Values& values, Object object) {
  const auto found = values.find(object.key());
  return found == values.end() ? std::nullopt : std::optional(found->second);
}

/// As the configuration names it: without a sub-index of 0.
std::string short_name(Object object) {
  return object.sub == 0 ? fmt::format("{:04X}h", object.index) : to_string(object);
}

/// Two objects that hold a ratio.
struct Pair {
  Object first, second;
};
constexpr Pair pair_at(std::uint16_t index) { return {{index, 1}, {index, 2}}; }
constexpr auto encoder = pair_at(0x608F), gear = pair_at(0x6091), feed = pair_at(0x6092),
               position_factor = pair_at(0x6093), acceleration_factor = pair_at(0x6097);
/// 6094h velocity encoder factor, 6095h and 6096h velocity factors.
constexpr std::array velocity_factors{position_factor, pair_at(0x6094), pair_at(0x6095), pair_at(0x6096)};
constexpr Object polarity{0x607E, 0}, velocity_notation{0x608B, 0}, velocity_dimension{0x608C, 0},
    acceleration_notation{0x608D, 0}, acceleration_dimension{0x608E, 0}, position_si{0x60A8, 0},
    velocity_si{0x60A9, 0}, acceleration_si{0x60AA, 0};

constexpr auto all_objects = std::to_array<Object>(
    {polarity,    velocity_notation, velocity_dimension, acceleration_notation, acceleration_dimension,
     {0x608F, 1}, {0x608F, 2},       {0x6091, 1},        {0x6091, 2},           {0x6092, 1},
     {0x6092, 2}, {0x6093, 1},       {0x6093, 2},        {0x6094, 1},           {0x6094, 2},
     {0x6095, 1}, {0x6095, 2},       {0x6096, 1},        {0x6096, 2},           {0x6097, 1},
     {0x6097, 2}, position_si,       velocity_si,        acceleration_si});

/// Both are there, and neither is 0, which says nothing.
std::optional<std::pair<std::int64_t, std::int64_t>> ratio_of(const Values& values, Pair pair) {
  const auto first = find(values, pair.first).value_or(0), second = find(values, pair.second).value_or(0);
  if (first <= 0 || second <= 0) return std::nullopt;
  return std::pair(first, second);
}
bool scales(const Values& values, Pair pair) {
  const auto ratio = ratio_of(values, pair);
  return ratio && ratio->first != ratio->second;
}
std::string text_of_ratio(const Values& values, Pair pair) {
  const auto [first, second] = ratio_of(values, pair).value_or(std::pair(0, 0));
  return fmt::format("{:04X}h is {}:{}", pair.first.index, first, second);
}

/// An SI unit (CiA 402-2): prefix, numerator, denominator.
struct SiUnit {
  int exponent;
  unsigned numerator, denominator;
};
SiUnit si_of(std::int64_t value) {
  const auto bits = static_cast<std::uint32_t>(value);
  return {static_cast<std::int8_t>(bits >> 24U), bits >> 16U & 0xFFU, bits >> 8U & 0xFFU};
}

// CiA 303-2; C0h is what makers have for r/min within 60AAh.
constexpr unsigned si_radian = 0x10, si_degree = 0x41, si_revolution = 0xB4, si_increment = 0xB5,
                   si_second = 0x03, si_minute = 0x47, si_rpm = 0xC0;
/// Dimension index: r/min. As an acceleration: that in a second.
constexpr std::int64_t dimension_rpm = 0xA4;

std::optional<Angle> angle_of(unsigned code) {
  switch (code) {
    case si_radian:
      return Angle::radian;
    case si_degree:
      return Angle::degree;
    case si_revolution:
      return Angle::revolution;
    case si_increment:
      return Angle::pulse;
    default:
      return std::nullopt;
  }
}

std::optional<Rate> rate_of(Angle angle, Per per, int exponent) {
  if (std::abs(exponent) > largest_exponent) return std::nullopt;
  return Rate{.angle = angle, .per = per, .exponent = static_cast<std::int8_t>(exponent)};
}

/// Increments of 60A9h are those of 6064h only where 60A8h does not say otherwise.
bool counts_increments(const Values& values) {
  const auto code = si_of(find(values, position_si).value_or(0)).numerator;
  return code == 0 || code == si_increment;
}

std::optional<Rate> velocity_of_si(const Values& values, std::int64_t value) {
  const auto si = si_of(value);
  const auto angle = angle_of(si.numerator);
  if (!angle || (angle == Angle::pulse && !counts_increments(values))) return std::nullopt;
  if (si.denominator != si_second && si.denominator != si_minute) return std::nullopt;
  return rate_of(*angle, si.denominator == si_second ? Per::second : Per::minute, si.exponent);
}

std::optional<Rate> acceleration_of_si(std::int64_t value) {
  const auto si = si_of(value);
  if (si.numerator != si_rpm || si.denominator != si_second) return std::nullopt;
  return rate_of(Angle::revolution, Per::minute, si.exponent);
}

UnitTold told(Object object, std::optional<Rate> unit, std::string what) {
  return {.kind = unit ? UnitTold::Kind::unit : UnitTold::Kind::unclear,
          .unit = unit.value_or(Rate{}),
          .object = object,
          .what = std::move(what)};
}

UnitTold by_dimension(const Values& values, Object dimension, Object notation) {
  const auto code = find(values, dimension).value_or(0) & 0xFF;
  if (code == 0) return {};
  const auto power = static_cast<std::int8_t>(find(values, notation).value_or(0));
  std::optional<Rate> unit;
  if (code == dimension_rpm) unit = rate_of(Angle::revolution, Per::minute, power);
  return told(
      dimension, unit,
      fmt::format("{} is {:02X}h with {} = {}", short_name(dimension), code, short_name(notation), power));
}

/// What an SI unit says, and an index; both together have to say the same.
UnitTold agreed(UnitTold si, UnitTold index) {
  using Kind = UnitTold::Kind;
  if (si.kind == Kind::nothing) return index;
  if (index.kind == Kind::nothing || (si.kind == index.kind && si.unit == index.unit)) return si;
  return told(si.object, std::nullopt, fmt::format("{}, and {}", si.what, index.what));
}

std::string si_text(Object object, std::int64_t value) {
  return fmt::format("{} is {:08X}h", short_name(object), static_cast<std::uint32_t>(value));
}

std::string_view source_text(const Units& planned) {
  return planned.velocity_source == UnitSource::configuration ? "drive.velocity_unit says"
                                                              : "its data sheet says";
}

/// How to say in the configuration that the object is wrong.
std::string remedy_without(Object object) {
  return fmt::format("where {} is wrong, add drive: {{ objects: {{ {} }} }}", short_name(object),
                     without(object));
}

std::optional<PlanConflict> polarity_conflict(const Values& values) {
  constexpr std::int64_t position_bit = 0x80, velocity_bit = 0x40;
  const auto value = find(values, polarity).value_or(0);
  if (((value & position_bit) != 0) == ((value & velocity_bit) != 0)) return std::nullopt;
  return PlanConflict{
      .object = polarity,
      .message = fmt::format("it turns positions or velocities round, and not both ({} is {:02X}h)",
                             short_name(polarity), value & 0xFF),
      .remedy =
          "set both or none of bits 6 and 7 of 607Eh with the drive's own tool; scale: { invert: true } "
          "turns the axis; " +
          remedy_without(polarity)};
}

std::optional<PlanConflict> velocity_conflict(const Units& planned, const Values& values) {
  const auto told = told_velocity(values);
  const bool by_key = planned.velocity_source == UnitSource::configuration;
  switch (told.kind) {
    case UnitTold::Kind::nothing:
      return std::nullopt;
    case UnitTold::Kind::unclear:
      if (by_key) return std::nullopt;
      return PlanConflict{.object = told.object,
                          .message = fmt::format("what its velocities count is not clear: {}; {} {}",
                                                 told.what, source_text(planned), text_of(planned.velocity)),
                          .remedy = "say what the drive's manual says: drive: { velocity_unit: UNIT }"};
    case UnitTold::Kind::unit:
      break;
  }
  if (told.unit == planned.velocity) return std::nullopt;
  const auto name = name_of(told.unit);
  return PlanConflict{
      .object = told.object,
      .message = fmt::format("its velocities count {} ({}), and {} {}", text_of(told.unit), told.what,
                             source_text(planned), text_of(planned.velocity)),
      .remedy = fmt::format("{}, or set the drive with its own tool; {}",
                            name.empty() ? std::string("correct drive: { velocity_unit: ... }")
                                         : fmt::format("write drive: {{ velocity_unit: {} }}", name),
                            remedy_without(told.object))};
}

std::optional<PlanConflict> acceleration_conflict(const Units& planned, const Values& values) {
  const auto told = told_acceleration(values);
  if (told.kind == UnitTold::Kind::nothing) return std::nullopt;
  const bool rates = planned.ramps == Ramps::rates;
  if (rates && told.kind == UnitTold::Kind::unit && told.unit == planned.acceleration) return std::nullopt;
  const bool by_key = planned.acceleration_source == UnitSource::configuration;
  if (told.kind == UnitTold::Kind::unclear && (by_key || !rates)) return std::nullopt;
  const auto seconds = [](Rate unit) { return text_of(unit) + " per second"; };
  return PlanConflict{
      .object = told.object,
      .message = fmt::format("its ramps count {} ({}), and the axis is planned with {}",
                             told.kind == UnitTold::Kind::unit ? seconds(told.unit) : "something unclear",
                             told.what, rates ? seconds(planned.acceleration) : "times (drive.ramps)"),
      .remedy =
          "say what the drive's manual says: drive: { ramps: rate, acceleration_unit: UNIT }, or set the "
          "drive with its own tool; " +
          remedy_without(told.object)};
}

std::optional<PlanConflict> revolution_conflict(std::int64_t pulses_per_revolution, const Values& values) {
  const auto told = told_revolution(values);
  if (!told || told->fits(pulses_per_revolution)) return std::nullopt;
  return PlanConflict{
      .object = told->object,
      .message = fmt::format("a revolution has {} counts ({}), and scale.microstep says {} pulses/rev",
                             told->revolutions == 1 ? fmt::to_string(told->counts)
                                                    : fmt::format("{}/{}", told->counts, told->revolutions),
                             told->what, pulses_per_revolution),
      .remedy = "correct scale: { microstep: ... }, or set the drive with its own tool; " +
                remedy_without(told->object)};
}

}  // namespace

UnitTold told_velocity(const Values& values) {
  UnitTold si;
  if (const auto value = find(values, velocity_si).value_or(0); value != 0)
    si = told(velocity_si, velocity_of_si(values, value), si_text(velocity_si, value));
  auto all = agreed(std::move(si), by_dimension(values, velocity_dimension, velocity_notation));
  for (const auto factor : velocity_factors)
    if (scales(values, factor)) return told(factor.first, std::nullopt, text_of_ratio(values, factor));
  return all;
}

UnitTold told_acceleration(const Values& values) {
  UnitTold si;
  if (const auto value = find(values, acceleration_si).value_or(0); value != 0)
    si = told(acceleration_si, acceleration_of_si(value), si_text(acceleration_si, value));
  auto all = agreed(std::move(si), by_dimension(values, acceleration_dimension, acceleration_notation));
  if (scales(values, acceleration_factor))
    return told(acceleration_factor.first, std::nullopt, text_of_ratio(values, acceleration_factor));
  return all;
}

bool RevolutionTold::fits(std::int64_t pulses_per_revolution) const {
  return nearest(Wide{counts}, Wide{revolutions}) == pulses_per_revolution;
}

std::optional<RevolutionTold> told_revolution(const Values& values) {
  if (scales(values, position_factor)) return std::nullopt;
  if (const auto value = find(values, position_si).value_or(0); value != 0 && !counts_increments(values)) {
    const auto si = si_of(value);
    const auto angle = angle_of(si.numerator);
    if (!angle || si.denominator != 0 || si.exponent > 0 || si.exponent < -largest_exponent)
      return std::nullopt;
    const auto one = revolutions_of(*angle, 1);
    return RevolutionTold{
        .counts = saturated(nearest(one.denominator * power_of_ten(-si.exponent), one.numerator),
                            std::numeric_limits<std::int64_t>::max()),
        .object = position_si,
        .what = si_text(position_si, value)};
  }
  const auto real = [&](Pair pair) {
    const auto ratio = ratio_of(values, pair);
    return ratio && ratio->first != ratio->second ? ratio : std::nullopt;
  };
  if (const auto ratio = real(feed))
    return RevolutionTold{ratio->first, ratio->second, feed.first, text_of_ratio(values, feed)};
  const auto ratio = real(encoder);
  if (!ratio) return std::nullopt;
  const auto turned = real(gear);
  const auto [motor, shaft] = turned.value_or(std::pair<std::int64_t, std::int64_t>(1, 1));
  return RevolutionTold{
      saturated(Wide{ratio->first} * motor, std::numeric_limits<std::int64_t>::max()),
      saturated(Wide{ratio->second} * shaft, std::numeric_limits<std::int64_t>::max()), encoder.first,
      text_of_ratio(values, encoder) + (turned ? ", " + text_of_ratio(values, gear) : std::string())};
}

std::optional<PlanConflict> find_conflict(const Units& planned,
                                          std::optional<std::int64_t> pulses_per_revolution,
                                          const Values& values) {
  if (auto conflict = polarity_conflict(values)) return conflict;
  if (auto conflict = velocity_conflict(planned, values)) return conflict;
  if (auto conflict = acceleration_conflict(planned, values)) return conflict;
  if (pulses_per_revolution) return revolution_conflict(*pulses_per_revolution, values);
  return std::nullopt;
}

std::span<const Object> unit_objects() { return all_objects; }

std::string_view key_of(Object object) {
  switch (object.index) {
    case polarity.index:
      return "scale.invert";
    case encoder.first.index:
    case gear.first.index:
    case feed.first.index:
    case position_factor.first.index:
    case position_si.index:
      return "scale.microstep";
    case acceleration_notation.index:
    case acceleration_dimension.index:
    case acceleration_factor.first.index:
    case acceleration_si.index:
      return "drive.acceleration_unit";
    default:
      return "drive.velocity_unit";
  }
}

std::string without(Object object) { return fmt::format("{}: {{ access: none }}", short_name(object)); }

}  // namespace axisd::cia402
