// Control commands in the words of an axis: its units, its direction, the levels of its terminals. Pure.
#pragma once

#include <string>
#include <string_view>

#include "buses/error.hpp"
#include "devices/axis/settings.hpp"

namespace axisd::simulation {

/// The command of execute_control() that does one of these to the drive of `axis`:
///   power on|off; input TERMINAL on|off|auto (on: active, as the configuration has it; auto: as the machine
///   has it); alarm CODE (0: its cause is gone); block on|off (the shaft cannot turn); push DISTANCE (the
///   load turns the released shaft; user units, axis direction); lose COUNT (of its replies); show
/// Error: what is wrong, and how to write it.
Result<std::string> axis_command(const AxisSettings& axis, std::string_view words);

/// The reply of execute_control() to it, for people: "ok", "ok the load is at 12.5 mm, at rest, 3 starts",
/// "error ...". `start_position`: where the load was at power-up, user units.
std::string axis_reply(const AxisSettings& axis, double start_position, std::string_view reply);

}  // namespace axisd::simulation
