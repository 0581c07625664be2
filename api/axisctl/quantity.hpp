// Arguments with units: "120mm", "-10", "50 mm/s", "150ms". Pure.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace axisd::axisctl {

/// A value in `unit`; the text may carry the unit, leave it out, or have another that measures the same,
/// which is converted: "12cm" is 120 in "mm". `what` names the argument in errors. Throws Failure (usage) for
/// anything else, NaN and infinity included.
double parse_value(std::string_view text, std::string_view unit, std::string_view what);

/// A time with its unit, "150ms", "2s": a bare number would be ambiguous. Not negative. Throws Failure
/// (usage).
std::chrono::nanoseconds parse_duration(std::string_view text, std::string_view what);

/// Of what is numbered in order of time: what lies behind a number, or is younger than so long.
struct Since {
  std::optional<std::uint64_t> number;
  std::chrono::nanoseconds ago{};  ///< without a number
};
/// "120", "10min". Throws Failure (usage), which names both forms.
Since parse_since(std::string_view text, std::string_view what);

/// Decimal or 0x, signed. Throws Failure (usage). `what` names the argument.
std::int64_t parse_integer(std::string_view text, std::string_view what);

}  // namespace axisd::axisctl
