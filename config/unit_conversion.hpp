// The same quantity in another unit. What a configuration says is never converted: there it is a hint about
// a unit that was mistaken. The command line takes it.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "config/quantity.hpp"

namespace axisd::config {

/// `number` of the unit `from` in the unit `to`, as it would be written: 12 of "cm" in "mm" is "120".
/// Lengths, angles, times, and quotients of these ("m/min" in "mm/s"), also under their usual other names
/// ("millimetres", "sec"). Nothing: they do not measure the same, one of them is not known, or it takes more
/// than 9 digits.
std::optional<std::string> converted(const Decimal& number, std::string_view from, std::string_view to);

/// The same as a number, the nearest to what it exactly is: 1 of "mm/min" in "mm/s" is 0.0166666666666666.
/// Nothing: they do not measure the same, one of them is not known, or its fraction does not fit into 64 bit.
std::optional<double> converted_value(const Decimal& number, std::string_view from, std::string_view to);

/// Usual units that measure the same as `unit`: "mm", "cm" ... of a length; none: it is not known.
std::span<const std::string_view> units_like(std::string_view unit);

/// The same as a time: in the unit that was meant, where only its name was wrong ("90 sec" is "90 s"), else
/// in the largest of us, ms, s and min in which it is 1 or more ("2 h" is "120 min"). Nothing: `from` is no
/// known unit of time.
std::optional<std::string> converted_time(const Decimal& number, std::string_view from);

}  // namespace axisd::config
