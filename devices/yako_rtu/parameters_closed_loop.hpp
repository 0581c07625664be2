// The register groups that the two closed-loop models, SSD2608PR and ESS42-R, print alike in 6.1.
#pragma once

#include <array>

#include "devices/descriptor.hpp"

namespace axisd::yako_rtu {

// clang-format off

/// Control 1, first part, 0x0010..0x0012.
inline constexpr auto closed_loop_control_rows = std::to_array<ParameterSpec>({
    {0x0010, "pulse_polarity", Access::rw_saved, 0, 1, 0, "",
     "Level of the pulse and direction signals: 0 Pulse Sign, 1 Pulse /Sign (direction inverted); the drive "
     "has no pulse input"},
    {0x0011, "microstep", Access::rw_saved, 0, 15, 8, "",
     "Pulses per revolution: 0..7 400 x 2^n, 8 1000, 9 2000, 10 4000, 11 5000, 12 8000, 13 10000, 14 "
     "20000, 15 40000"},
    {0x0012, "loop_mode", Access::rw_saved, 0, 1, 0, "", "0 closed loop, 1 open loop"},
});

/// Control 1, last register; printed "读写" (RW) without /S, unlike its neighbours.
inline constexpr auto closed_loop_overtravel_rows = std::to_array<ParameterSpec>({
    {0x0017, "overtravel_stop", Access::rw, 0, 2, 0, "",
     "At a limit terminal: 0 free stop, 1 quick stop, 2 ignore the limit; not kept in EEPROM by a write"},
});

/// Performance, 0x0110..0x0139. Of most of them the manual says only "factory setting, normally not to be
/// changed"; it gives no units but the percentages in the names.
inline constexpr auto closed_loop_performance_rows = std::to_array<ParameterSpec>({
    {0x0110, "encoder_resolution", Access::rw_saved, 0, 1, 0, "", "Encoder lines: 0 1000, 1 2500"},
    {0x0111, "pulse_input_limit", Access::rw_saved, 0, 65535, 5, "",
     "Frequency limit of the pulse input; factory setting, the manual gives no unit"},
    {0x0112, "closed_loop_current_percent", Access::rw_saved, 0, 150, 100, "%",
     "Current in closed loop; factory setting"},
    {0x0113, "open_loop_current_percent", Access::rw_saved, 0, 100, 50, "%",
     "Current in open loop; factory setting"},
    {0x0114, "lock_current_percent", Access::rw_saved, 0, 100, 40, "%",
     "Current at standstill; factory setting"},
    {0x0115, "lock_current_time", Access::rw_saved, 100, 500, 100, "",
     "Time until the current at standstill applies; factory setting, the manual gives no unit"},
    {0x0116, "deviation_alarm_threshold", Access::rw_saved, 0, 20000, 4000, "",
     "Position deviation that raises alarm 5; factory setting, the manual gives no unit"},
    {0x0117, "in_position_threshold", Access::rw_saved, 1, 4000, 10, "",
     "Control mode and threshold of the in-position signal; factory setting, the manual gives no unit"},
    {0x0118, "speed_smoothing", Access::rw_saved, 0, 1024, 5, "",
     "Strength of speed smoothing; factory setting"},
    {0x0119, "position_proportional", Access::rw_saved, 1, 256, 16, "",
     "Position, proportional coefficient; factory setting"},
    {0x011A, "speed_proportional", Access::rw_saved, 1, 256, 16, "",
     "Speed, proportional coefficient; factory setting"},
    {0x011B, "speed_feedforward", Access::rw_saved, 0, 200, 162, "",
     "Speed feed-forward coefficient; factory setting"},
    {0x011C, "current_loop_proportional", Access::rw_saved, 0, 30000, 8000, "",
     "Current loop, proportional coefficient; factory setting"},
    {0x011D, "current_loop_integral", Access::rw_saved, 0, 1000, 48, "",
     "Current loop, integral coefficient; factory setting"},
    {0x011E, "encoder_filter", Access::rw_saved, 0, 1024, 358, "",
     "Filter coefficient of the encoder feedback; factory setting"},
    {0x011F, "positioning_accuracy", Access::rw_saved, 1, 200, 10, "",
     "Accuracy at which positioning is complete; factory setting, the manual gives no unit"},
    {0x0120, "closed_loop_algorithm", Access::rw_saved, 0, 1, 0, "",
     "Closed-loop control algorithm 0 or 1; factory setting, the manual does not name them"},
    {0x0121, "high_speed_coefficient", Access::rw_saved, 0, 65535, 15360, "",
     "High-speed adjustment coefficient (ea limit); factory setting"},
    {0x0122, "torque_coefficient", Access::rw_saved, 1, 50, 16, "",
     "Torque adjustment coefficient (ea); factory setting"},
    {0x0123, "speed_node_1", Access::rw_saved, 1, 50, 10, "", "Speed node 1; factory setting"},
    {0x0124, "position_proportional_1", Access::rw_saved, 0, 65535, 32, "",
     "Position, proportional coefficient 1; factory setting"},
    {0x0125, "speed_proportional_1", Access::rw_saved, 0, 65535, 320, "",
     "Speed, proportional coefficient 1; factory setting"},
    {0x0126, "speed_node_2", Access::rw_saved, 1, 50, 15, "", "Speed node 2; factory setting"},
    {0x0127, "position_proportional_2", Access::rw_saved, 0, 65535, 33, "",
     "Position, proportional coefficient 2; factory setting"},
    {0x0128, "speed_proportional_2", Access::rw_saved, 0, 65535, 320, "",
     "Speed, proportional coefficient 2; factory setting"},
    {0x0129, "speed_node_3", Access::rw_saved, 1, 50, 20, "", "Speed node 3; factory setting"},
    {0x012A, "position_proportional_3", Access::rw_saved, 0, 65535, 35, "",
     "Position, proportional coefficient 3; factory setting"},
    {0x012B, "speed_proportional_3", Access::rw_saved, 0, 65535, 320, "",
     "Speed, proportional coefficient 3; factory setting"},
    {0x012C, "speed_node_4", Access::rw_saved, 1, 50, 30, "", "Speed node 4; factory setting"},
    {0x012D, "position_proportional_4", Access::rw_saved, 0, 65535, 38, "",
     "Position, proportional coefficient 4; factory setting"},
    {0x012E, "speed_proportional_4", Access::rw_saved, 0, 65535, 384, "",
     "Speed, proportional coefficient 4; factory setting"},
    {0x012F, "speed_node_5", Access::rw_saved, 1, 50, 40, "", "Speed node 5; factory setting"},
    {0x0130, "position_proportional_5", Access::rw_saved, 0, 65535, 39, "",
     "Position, proportional coefficient 5; factory setting"},
    {0x0131, "speed_proportional_5", Access::rw_saved, 0, 65535, 512, "",
     "Speed, proportional coefficient 5; factory setting"},
    {0x0132, "speed_node_6", Access::rw_saved, 1, 50, 45, "", "Speed node 6; factory setting"},
    {0x0133, "position_proportional_6", Access::rw_saved, 0, 65535, 40, "",
     "Position, proportional coefficient 6; factory setting"},
    {0x0134, "speed_proportional_6", Access::rw_saved, 0, 65535, 640, "",
     "Speed, proportional coefficient 6; factory setting"},
    {0x0135, "holding_position_proportional", Access::rw_saved, 0, 65535, 32, "",
     "Position at standstill, proportional coefficient; factory setting"},
    {0x0136, "holding_speed_proportional", Access::rw_saved, 0, 65535, 320, "",
     "Speed at standstill, proportional coefficient; factory setting"},
    {0x0137, "input_filter_x0_x1", Access::rw_saved, 0, 65535, 10, "",
     "Filter of inputs X0 and X1; the manual gives no unit"},
    {0x0138, "input_filter_x2_x3", Access::rw_saved, 0, 65535, 10, "",
     "Filter of inputs X2 and X3; the manual gives no unit"},
    {0x0139, "input_filter_x4", Access::rw_saved, 0, 65535, 10, "",
     "Filter of input X4 (the ESS42-R has no X4, but the register); the manual gives no unit"},
});

// clang-format on

}  // namespace axisd::yako_rtu
