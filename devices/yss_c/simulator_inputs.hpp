// Codes of the input functions of the simulated YSS-C (7, 2030h).
#pragma once

#include <cstdint>

namespace axisd::yss_c {

inline constexpr std::uint8_t input_home = 1, input_positive_limit = 2, input_negative_limit = 3,
                              input_enable = 4, input_release = 5, input_alarm_clear = 6, input_factory = 7,
                              input_stop = 8, input_stop_at_once = 9, input_position = 10,
                              input_velocity = 11, input_jog_positive = 12, input_jog_negative = 13,
                              input_homing = 14;

}  // namespace axisd::yss_c
