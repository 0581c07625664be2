// What becomes of the position when the motor is released, where a manual does not say it (M20).
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "devices/descriptor.hpp"
#include "devices/setup_values.hpp"

namespace axisd {

inline constexpr std::string_view released_positions[] = {"lost", "counted"};
/// Of closed-loop models whose manual does not say whether the position follows a shaft that is turned while
/// the motor is released.
inline constexpr SettingSpec released_position_setting = {
    .key = "released_position",
    .kind = "enum",
    .choices = released_positions,
    .default_value = "lost",
    .description =
        "The manual does not say whether the position follows a shaft that is turned while the motor is "
        "released. lost: each release loses the position. counted: it is kept. Try it first: disable the "
        "axis, "
        "turn the shaft by hand, and see that its position follows."};

/// What a closed loop shows after a release holds: the axis's settings say so, or its model has no such
/// setting, because there it is not open.
bool counts_released(const DriveDescriptor& drive, const std::map<std::string, SettingValue>& settings);

}  // namespace axisd
