#include "config/unit_conversion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>

namespace axisd::config {

namespace {

enum class Kind : std::uint8_t { length, angle, time };

struct Unit {
  std::string_view name;
  Kind kind;
  std::int64_t size;  ///< in micrometres, degrees or nanoseconds
};

constexpr auto units = std::to_array<Unit>({
    {"um", Kind::length, 1},
    {"mm", Kind::length, 1'000},
    {"millimeter", Kind::length, 1'000},
    {"millimetre", Kind::length, 1'000},
    {"cm", Kind::length, 10'000},
    {"centimeter", Kind::length, 10'000},
    {"centimetre", Kind::length, 10'000},
    {"dm", Kind::length, 100'000},
    {"m", Kind::length, 1'000'000},
    {"meter", Kind::length, 1'000'000},
    {"metre", Kind::length, 1'000'000},
    {"in", Kind::length, 25'400},
    {"inch", Kind::length, 25'400},
    {"inches", Kind::length, 25'400},
    {"deg", Kind::angle, 1},
    {"degree", Kind::angle, 1},
    {"rev", Kind::angle, 360},
    {"r", Kind::angle, 360},
    {"revolution", Kind::angle, 360},
    {"rotation", Kind::angle, 360},
    {"turn", Kind::angle, 360},
    {"ns", Kind::time, 1},
    {"us", Kind::time, 1'000},
    {"ms", Kind::time, 1'000'000},
    {"msec", Kind::time, 1'000'000},
    {"millisecond", Kind::time, 1'000'000},
    {"s", Kind::time, 1'000'000'000},
    {"sec", Kind::time, 1'000'000'000},
    {"second", Kind::time, 1'000'000'000},
    {"min", Kind::time, 60'000'000'000},
    {"minute", Kind::time, 60'000'000'000},
    {"h", Kind::time, 3'600'000'000'000},
    {"hr", Kind::time, 3'600'000'000'000},
    {"hour", Kind::time, 3'600'000'000'000},
});

/// Also in capitals and in the plural. A capital alone is none: M is no metre.
const Unit* find(std::string_view text) {
  if (text.size() == 1 && text[0] < 'a') return nullptr;
  std::string name(text);
  std::ranges::transform(name, name.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? char(c + 32) : c; });
  auto found = std::ranges::find(units, name, &Unit::name);
  if (found == units.end() && name.size() > 2 && name.ends_with('s'))
    found = std::ranges::find(units, name.substr(0, name.size() - 1), &Unit::name);
  return found == units.end() ? nullptr : &*found;
}

struct Quotient {
  const Unit* above = nullptr;
  const Unit* below = nullptr;  ///< nullptr: a unit alone
};

std::optional<Quotient> quotient(std::string_view text) {
  if (text == "rpm" || text == "RPM") text = "r/min";
  const auto slash = text.find('/');
  const Quotient found{.above = find(text.substr(0, slash)),
                       .below = slash == std::string_view::npos ? nullptr : find(text.substr(slash + 1))};
  if (found.above == nullptr || (slash != std::string_view::npos && found.below == nullptr))
    return std::nullopt;
  return found;
}

/// a/b, kept in lowest terms; nothing once it does not fit.
class Fraction {
 public:
  Fraction(std::int64_t above, std::int64_t below) : above_(above), below_(below) {}
  void multiply(std::int64_t above, std::int64_t below) {
    const auto cross = std::gcd(above_, below), other = std::gcd(above, below_);
    fits_ = fits_ && !__builtin_mul_overflow(above_ / cross, above / other, &above_) &&
            !__builtin_mul_overflow(below_ / other, below / cross, &below_);
  }
  [[nodiscard]] std::optional<double> value() const {
    if (!fits_) return std::nullopt;
    return static_cast<double>(above_) / static_cast<double>(below_);
  }
  /// As a decimal that says it exactly.
  [[nodiscard]] std::optional<std::string> text() const {
    if (!fits_) return std::nullopt;
    auto text = format_number(*value());
    const auto same = parse_decimal(text);
    if (!same || same->numerator != above_ || same->denominator != below_) return std::nullopt;
    return text;
  }

 private:
  std::int64_t above_, below_;
  bool fits_ = true;
};

std::optional<Fraction> converted_fraction(const Decimal& number, std::string_view from,
                                           std::string_view to) {
  const auto source = quotient(from), target = quotient(to);
  if (!source || !target || source->above->kind != target->above->kind) return std::nullopt;
  if ((source->below == nullptr) != (target->below == nullptr)) return std::nullopt;
  Fraction result(number.numerator, number.denominator);
  const auto common = std::gcd(source->above->size, target->above->size);
  result.multiply(source->above->size / common, target->above->size / common);
  if (source->below != nullptr) {
    if (source->below->kind != target->below->kind) return std::nullopt;
    const auto shared = std::gcd(source->below->size, target->below->size);
    result.multiply(target->below->size / shared, source->below->size / shared);
  }
  return result;
}

constexpr auto lengths = std::to_array<std::string_view>({"mm", "cm", "m", "um", "in"});
constexpr auto angles = std::to_array<std::string_view>({"deg", "rev"});
constexpr auto linear_rates =
    std::to_array<std::string_view>({"mm/s", "cm/s", "m/s", "um/s", "in/s", "mm/min", "m/min"});
constexpr auto angular_rates = std::to_array<std::string_view>({"deg/s", "deg/min", "rev/s", "rpm"});

}  // namespace

std::optional<std::string> converted(const Decimal& number, std::string_view from, std::string_view to) {
  const auto result = converted_fraction(number, from, to);
  return result ? result->text() : std::nullopt;
}

std::optional<double> converted_value(const Decimal& number, std::string_view from, std::string_view to) {
  const auto result = converted_fraction(number, from, to);
  return result ? result->value() : std::nullopt;
}

std::span<const std::string_view> units_like(std::string_view unit) {
  const auto known = quotient(unit);
  if (!known || (known->below != nullptr && known->below->kind != Kind::time)) return {};
  const bool rate = known->below != nullptr;
  switch (known->above->kind) {
    case Kind::length:
      return rate ? std::span<const std::string_view>(linear_rates) : lengths;
    case Kind::angle:
      return rate ? std::span<const std::string_view>(angular_rates) : angles;
    case Kind::time:
      break;
  }
  return {};
}

std::optional<std::string> converted_time(const Decimal& number, std::string_view from) {
  std::optional<std::string> best;
  for (const std::string_view unit : {"us", "ms", "s", "min"}) {
    const auto text = converted(number, from, unit);
    if (!text) continue;
    const auto value = parse_decimal(*text);
    if (best && (!value || std::abs(value->value) < 1)) break;
    best = fmt::format("{} {}", *text, unit);
    if (value && value->value == number.value && number.value != 0) break;
  }
  return best;
}

}  // namespace axisd::config
