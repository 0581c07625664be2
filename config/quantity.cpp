#include "config/quantity.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numeric>
#include <optional>

#include "config/text.hpp"
#include "config/unit_conversion.hpp"

namespace axisd::config {

namespace {

constexpr std::int64_t largest = 1'000'000'000'000'000'000;  // 10^18: 18 digits always fit

std::string_view trim(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

/// How many characters of `text` a decimal takes; 0 if it does not start with one.
std::size_t decimal_length(std::string_view text) {
  std::size_t at = 0;
  const auto digits = [&] {
    const auto from = at;
    while (at < text.size() && is_digit(text[at])) ++at;
    return at - from;
  };
  if (at < text.size() && (text[at] == '+' || text[at] == '-')) ++at;
  auto count = digits();
  if (at < text.size() && text[at] == '.') {
    ++at;
    count += digits();
  }
  if (count == 0) return 0;
  if (at < text.size() && (text[at] == 'e' || text[at] == 'E')) {  // an exponent only if digits follow it
    const auto before = at++;
    if (at < text.size() && (text[at] == '+' || text[at] == '-')) ++at;
    if (digits() == 0) at = before;
  }
  return at;
}

std::unexpected<QuantityError> wrong(std::string message, std::string suggestion) {
  return std::unexpected(QuantityError{std::move(message), std::move(suggestion)});
}

std::unexpected<QuantityError> not_a_number(std::string_view text) {
  // With which of its commas it would be the number that was meant, nobody can say.
  if (text.find(',') != std::string_view::npos) {
    return wrong(fmt::format("{} is not a number", quoted(text)),
                 "use a point for decimals, and nothing between thousands");
  }
  return wrong(fmt::format("{} is not a number", quoted(text)),
               "write a finite decimal number, such as 12.5");
}

std::unexpected<QuantityError> too_large(std::string_view text) {
  return wrong(fmt::format("{} is too large", quoted(text)), "write a number of 18 digits at most");
}

std::unexpected<QuantityError> too_long(std::string_view text) {
  return wrong(fmt::format("{} does not fit into 18 digits", quoted(text)), "round it");
}

Decimal reduced(std::int64_t numerator, std::int64_t denominator, double value) {
  const auto divisor = std::gcd(numerator, denominator);  // > 0: the denominator is
  return {numerator / divisor, denominator / divisor, value};
}

/// numerator * 10^exponent as a fraction, if it fits.
std::optional<Decimal> scaled(std::int64_t numerator, int exponent, double value) {
  if (numerator == 0) return Decimal{0, 1, 0};
  std::int64_t denominator = 1;
  for (; exponent < 0; ++exponent) {
    if (numerator % 10 == 0) {
      numerator /= 10;
    } else if (denominator >= largest) {
      return std::nullopt;
    } else {
      denominator *= 10;
    }
  }
  for (; exponent > 0; --exponent) {
    if (std::abs(numerator) >= largest / 10) return std::nullopt;
    numerator *= 10;
  }
  return reduced(numerator, denominator, value);
}

bool is_unit(std::string_view unit) {
  if (unit.empty() || unit.size() > 32 || !is_letter(unit.front()) || !is_letter(unit.back())) return false;
  return std::ranges::all_of(unit, [](char c) { return is_letter(c) || c == '/'; }) &&
         std::ranges::count(unit, '/') <= 1;
}

std::string without_spaces(std::string_view text) {
  std::string result(text);
  std::erase_if(result, [](char c) { return c == ' ' || c == '\t'; });
  return result;
}

QuantityError missing_unit(std::string_view text, std::string_view unit) {
  return {fmt::format("{} has no unit", quoted(text)), fmt::format("write {} {}", printable(text), unit)};
}

/// A number of another unit is shown converted or not at all: "12 mm" is not what "12 cm" was to say.
QuantityError wrong_unit(const Decimal& number, std::string_view unit, std::string_view expected) {
  const auto same = converted(number, unit, expected);
  return {fmt::format("unit {} does not fit here", quoted(unit)),
          same ? fmt::format("write {} {}", *same, expected) : fmt::format("expected {}", expected)};
}

QuantityError wrong_time_unit(const Decimal& number, std::string_view unit) {
  const auto same = converted_time(number, unit);
  return {fmt::format("unit {} does not fit here", quoted(unit)),
          same ? "write " + *same : "expected a time in us, ms, s or min"};
}

struct TimeUnit {
  std::string_view name;
  std::int64_t nanoseconds;
};
constexpr std::array<TimeUnit, 4> time_units{
    {{"us", 1'000}, {"ms", 1'000'000}, {"s", 1'000'000'000}, {"min", 60'000'000'000}}};
constexpr double longest_ns = 100 * 3600e9;

/// What stands behind the e. Nothing: beyond 100.
std::optional<int> parse_exponent(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  int exponent = 0;
  const bool fits = std::from_chars(text.data(), text.data() + text.size(), exponent).ec == std::errc();
  return fits && std::abs(exponent) <= 100 ? std::optional(exponent) : std::nullopt;
}

/// What stands before the e, without its sign, as an integer and a power of ten; and where it ends.
struct Digits {
  std::int64_t numerator = 0;
  int exponent = 0;
  std::size_t end = 0;
};

/// Nothing: more digits than fit.
std::optional<Digits> read_digits(std::string_view text) {
  Digits read{.end = text.front() == '+' || text.front() == '-' ? 1U : 0U};
  int digits = 0;
  bool fraction = false;
  for (; read.end < text.size() && (is_digit(text[read.end]) || text[read.end] == '.'); ++read.end) {
    const char c = text[read.end];
    if (c == '.') {
      fraction = true;
      continue;
    }
    if (read.numerator != 0 || c != '0') ++digits;
    if (digits > 18) return std::nullopt;
    read.numerator = read.numerator * 10 + (c - '0');
    read.exponent -= fraction ? 1 : 0;
  }
  return read;
}

}  // namespace

QuantityResult<Decimal> parse_decimal(std::string_view text) {
  const auto all = trim(text);
  if (all.empty() || decimal_length(all) != all.size()) return not_a_number(text);

  const auto digits = read_digits(all);
  if (!digits) return too_long(text);
  auto [numerator, exponent, at] = *digits;
  if (at < all.size()) {
    const auto written = parse_exponent(all.substr(at + 1));
    if (!written) return all[at + 1] == '-' ? too_long(text) : too_large(text);
    exponent += *written;
  }
  if (exponent < -100'000) return too_long(text);
  if (all.front() == '-') numerator = -numerator;

  double value = 0;
  const auto body = all.front() == '+' ? all.substr(1) : all;
  std::from_chars(body.data(), body.data() + body.size(), value);
  const auto result = scaled(numerator, exponent, value);
  if (!result) return exponent > 0 ? too_large(text) : too_long(text);
  return *result;
}

QuantityResult<Quantity> parse_quantity(std::string_view text) {
  const auto all = trim(text);
  const auto length = decimal_length(all);
  if (length == 0) return not_a_number(text);
  const auto number = parse_decimal(all.substr(0, length));
  if (!number) return std::unexpected(number.error());
  const auto rest = trim(all.substr(length));
  if (rest.empty()) return Quantity{*number, {}};
  if (rest.front() == '.' || rest.front() == ',' || is_digit(rest.front())) return not_a_number(text);
  const auto unit = without_spaces(rest);
  if (!is_unit(unit)) {
    return wrong(fmt::format("{} is not a unit", quoted(rest)), "write a number and a unit, such as 50 mm/s");
  }
  return Quantity{*number, unit};
}

QuantityResult<Decimal> parse_in_unit(std::string_view text, std::string_view unit, UnitRule rule) {
  const auto quantity = parse_quantity(text);
  if (!quantity) return std::unexpected(quantity.error());
  const auto all = trim(text);
  if (quantity->unit.empty()) {
    if (rule == UnitRule::required) return std::unexpected(missing_unit(all, unit));
  } else if (quantity->unit != unit) {
    return std::unexpected(wrong_unit(quantity->number, quantity->unit, unit));
  }
  return quantity->number;
}

QuantityResult<Duration> parse_duration(std::string_view text) {
  const auto quantity = parse_quantity(text);
  if (!quantity) return std::unexpected(quantity.error());
  if (quantity->unit.empty())
    return wrong(fmt::format("{} has no unit", quoted(text)), "add it: us, ms, s or min");
  const auto unit = std::ranges::find(time_units, quantity->unit, &TimeUnit::name);
  if (unit == time_units.end()) return std::unexpected(wrong_time_unit(quantity->number, quantity->unit));
  if (quantity->number.value < 0)
    return wrong(fmt::format("{} is negative", quoted(text)), "write a time >= 0");
  const double nanoseconds = quantity->number.value * static_cast<double>(unit->nanoseconds);
  if (nanoseconds > longest_ns) return wrong(fmt::format("{} is too long", quoted(text)), "at most 6000 min");
  return Duration(std::llround(nanoseconds));
}

QuantityResult<Decimal> parse_ratio(std::string_view text) {
  const auto slash = text.find('/');
  if (slash == std::string_view::npos || text.find('/', slash + 1) != std::string_view::npos) {
    return wrong(fmt::format("{} is not a ratio", quoted(text)), "write two numbers, such as 10/1");
  }
  const auto above = parse_decimal(text.substr(0, slash)), below = parse_decimal(text.substr(slash + 1));
  if (!above || !below) {
    return wrong(fmt::format("{} is not a ratio", quoted(text)), "write two numbers, such as 10/1");
  }
  if (above->numerator <= 0 || below->numerator <= 0) {
    return wrong(fmt::format("{} is not positive", quoted(text)), "write two numbers above 0, such as 10/1");
  }
  // (a/b) / (c/d) = (a*d) / (b*c), after taking out what cancels.
  const auto common = std::gcd(above->numerator, below->numerator);
  const auto common_below = std::gcd(above->denominator, below->denominator);
  std::int64_t numerator = 0, denominator = 0;
  if (__builtin_mul_overflow(above->numerator / common, below->denominator / common_below, &numerator) ||
      __builtin_mul_overflow(above->denominator / common_below, below->numerator / common, &denominator)) {
    return too_long(text);
  }
  return reduced(numerator, denominator, above->value / below->value);
}

QuantityResult<Decimal> parse_ratio_in_unit(std::string_view text, std::string_view unit) {
  // A ratio has a digit after its slash, a unit has a letter there: "22/7 mm/rev", "5 mm/rev".
  const auto all = trim(text);
  const auto slash = all.find('/');
  const auto letter = static_cast<std::size_t>(std::ranges::find_if(all, is_letter) - all.begin());
  if (slash == std::string_view::npos || letter <= slash) {
    const auto number = parse_in_unit(text, unit);
    if (number && number->numerator <= 0) {
      return wrong(fmt::format("{} is not positive", quoted(text)), "write a number above 0");
    }
    return number;
  }
  const auto ratio = parse_ratio(all.substr(0, letter));
  if (!ratio) return ratio;
  const auto written = without_spaces(all.substr(letter));
  if (written.empty()) return std::unexpected(missing_unit(all, unit));
  if (written != unit) return std::unexpected(wrong_unit(*ratio, written, unit));
  return ratio;
}

QuantityResult<std::uint32_t> parse_object_address(std::string_view text) {
  const auto hexadecimal = [](std::string_view digits, std::size_t longest) -> std::optional<std::uint32_t> {
    std::uint32_t value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value, 16);
    const bool whole = error == std::errc() && end == digits.data() + digits.size();
    return whole && digits.size() <= longest ? std::optional(value) : std::nullopt;
  };
  if (text.starts_with("0x")) {
    if (const auto address = hexadecimal(text.substr(2), 6)) return *address;
  } else if (text.size() == 8 && text.substr(4, 2) == "h:") {
    const auto index = hexadecimal(text.substr(0, 4), 4), sub_index = hexadecimal(text.substr(6), 2);
    if (index && sub_index) return *index << 8U | *sub_index;
  }
  return wrong(fmt::format("{} is no object address", quoted(text)),
               "write index and sub-index, both hexadecimal, such as 6041h:00");
}

std::string format_number(double value) { return fmt::format("{:.9g}", value); }

std::string format_duration(Duration duration) {
  auto best = TimeUnit{"ns", 1};
  for (const auto& unit : time_units) {
    if (unit.name != "min" && duration.count() != 0 && duration.count() % unit.nanoseconds == 0) best = unit;
  }
  return duration.count() == 0 ? "0 ms"
                               : fmt::format("{} {}", duration.count() / best.nanoseconds, best.name);
}

std::string format_object_address(std::uint32_t address) {
  return fmt::format("{:04X}h:{:02X}", address >> 8U, address & 0xFFU);
}

}  // namespace axisd::config
