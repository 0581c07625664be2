#include "api/axisctl/quantity.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <iterator>
#include <vector>

#include "api/axisctl/error.hpp"
#include "config/quantity.hpp"
#include "config/text.hpp"
#include "config/unit_conversion.hpp"

namespace axisd::axisctl {
namespace {

Failure usage(std::string_view what, const config::QuantityError& error) {
  return {ExitCode::usage, fmt::format("{}: {}{}{}", what, error.message,
                                       error.suggestion.empty() ? "" : "; ", error.suggestion)};
}

/// "8h", "7d": longer than what a machine is told; at most ten years.
std::optional<std::chrono::nanoseconds> long_time(std::string_view text) {
  if (text.empty() || (text.back() != 'h' && text.back() != 'd')) return std::nullopt;
  const auto number = config::parse_decimal(text.substr(0, text.size() - 1));
  const double hours = text.back() == 'h' ? 1 : 24;
  constexpr double longest = 10 * 365 * 24;
  if (!number || number->value < 0 || number->value * hours > longest) return std::nullopt;
  return std::chrono::round<std::chrono::nanoseconds>(
      std::chrono::duration<double, std::ratio<3600>>(number->value * hours));
}

/// "mm, cm or m": `unit` first.
std::string fitting(std::string_view unit) {
  std::vector<std::string_view> units{unit};
  std::ranges::copy_if(config::units_like(unit), std::back_inserter(units),
                       [unit](std::string_view other) { return other != unit; });
  return config::alternatives(units);
}

}  // namespace

double parse_value(std::string_view text, std::string_view unit, std::string_view what) {
  const auto quantity = config::parse_quantity(text);
  if (!quantity) throw usage(what, quantity.error());
  if (quantity->unit.empty() || quantity->unit == unit) return quantity->number.value;
  if (const auto same = config::converted_value(quantity->number, quantity->unit, unit)) return *same;
  throw usage(what, {.message = fmt::format("unit {} does not fit here", config::quoted(quantity->unit)),
                     .suggestion = fmt::format("write it in {}", fitting(unit))});
}

std::chrono::nanoseconds parse_duration(std::string_view text, std::string_view what) {
  const auto duration = config::parse_duration(text);
  if (!duration) throw usage(what, duration.error());
  return *duration;
}

Since parse_since(std::string_view text, std::string_view what) {
  std::uint64_t number = 0;
  if (const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
      error == std::errc{} && end == text.data() + text.size())
    return {.number = number};
  if (const auto ago = config::parse_duration(text)) return {.number = std::nullopt, .ago = *ago};
  if (const auto ago = long_time(text)) return {.number = std::nullopt, .ago = *ago};
  throw Failure(ExitCode::usage,
                fmt::format("{}: {} is neither a number nor a time; write 120 for what comes behind it, or "
                            "90s, 10min, 8h or 7d for what is younger",
                            what, config::quoted(text)));
}

std::int64_t parse_integer(std::string_view text, std::string_view what) {
  std::string_view digits = text;
  const bool negative = digits.starts_with('-');
  if (negative) digits.remove_prefix(1);
  const bool hex = digits.starts_with("0x") || digits.starts_with("0X");
  if (hex) digits.remove_prefix(2);
  std::int64_t value = 0;
  const auto [end, error] =
      std::from_chars(digits.data(), digits.data() + digits.size(), value, hex ? 16 : 10);
  if (error != std::errc{} || end != digits.data() + digits.size() || digits.starts_with('-'))
    throw Failure(ExitCode::usage,
                  fmt::format("{}: '{}' is no whole number; write 12, -3 or 0x1F", what, text));
  return negative ? -value : value;
}

}  // namespace axisd::axisctl
