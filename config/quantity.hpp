// Numbers with units, as people write them in the YAML and on the command line: "120mm", "50 mm/s", "150ms",
// "10/1".
#pragma once

#include <cstdint>
#include <expected>
#include <string>
#include <string_view>

#include "buses/clock.hpp"

namespace axisd::config {

/// What is wrong with the text, and how to write it.
struct QuantityError {
  std::string message;     ///< "'50' has no unit"
  std::string suggestion;  ///< "write 50 mm/s"
};
template <class T>
using QuantityResult = std::expected<T, QuantityError>;

/// A number, exactly as written.
struct Decimal {
  std::int64_t numerator = 0, denominator = 1;  ///< lowest terms, denominator > 0
  double value = 0;                             ///< the nearest double; finite
};

struct Quantity {
  Decimal number;
  std::string unit;  ///< "mm/s"; empty if there is none
};

enum class UnitRule : std::uint8_t { required, optional };

/// "-1.5": sign, digits, decimal point, exponent; at most 18 significant digits.
QuantityResult<Decimal> parse_decimal(std::string_view text);
/// A decimal with any unit, or with none.
QuantityResult<Quantity> parse_quantity(std::string_view text);
/// A decimal in exactly this unit ("mm", "mm/s", "pulses/rev").
QuantityResult<Decimal> parse_in_unit(std::string_view text, std::string_view unit,
                                      UnitRule rule = UnitRule::required);
/// A time >= 0: "150ms", "2 s", "0.5 min", "20us"; at most 100 hours, whole nanoseconds.
QuantityResult<Duration> parse_duration(std::string_view text);
/// "10/1" or "3.7/1", both positive; as a fraction in lowest terms (value: their quotient).
QuantityResult<Decimal> parse_ratio(std::string_view text);
/// A decimal or ratio in this unit: "5 mm/rev", "22/7 mm/rev". Greater than zero.
QuantityResult<Decimal> parse_ratio_in_unit(std::string_view text, std::string_view unit);

/// An object of a CANopen node, "6041h:00" or "0x604100": its index << 8 | sub-index, at most 0xFFFFFF.
QuantityResult<std::uint32_t> parse_object_address(std::string_view text);

/// Up to 9 significant digits, without trailing zeros: 100, 0.25, 33.3333333.
std::string format_number(double value);
/// "150 ms", "2 s": in the largest unit that needs no fraction.
std::string format_duration(Duration duration);
/// "6041h:00"
std::string format_object_address(std::uint32_t address);

}  // namespace axisd::config
