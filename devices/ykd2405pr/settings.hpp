#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace axisd::ykd2405pr {

/// Choices of `drive: { current: ... }` in the order of the codes of register 0x0010 (manual 6.1, RMS
/// values).
inline constexpr std::array<std::string_view, 12> current_choices = {
    "0.5A", "0.8A", "1.0A", "1.2A", "1.5A", "1.9A", "2.3A", "2.7A", "3.1A", "3.5A", "4.0A", "4.2A"};

/// Pulses per revolution in the order of the codes of register 0x0011 (manual 6.1).
inline constexpr std::array<std::int32_t, 16> microstep_codes = {
    200, 400, 800, 1600, 3200, 6400, 12800, 25600, 1000, 2000, 4000, 5000, 8000, 10000, 20000, 40000};

}  // namespace axisd::ykd2405pr
