// Register addresses that the family's manuals have in common (6.1), and those of single models by their
// names. The only thing that driver and simulator share, with the parameter tables.
#pragma once

#include <cstdint>

namespace axisd::yako_rtu {

namespace reg {
inline constexpr std::uint16_t model = 0x0000, version = 0x0001, node = 0x0002, mode = 0x0003,
                               moving = 0x0004, direction = 0x0005, alarm = 0x0006, status = 0x0007,
                               inputs = 0x0008, outputs = 0x0009, position_high = 0x000A,
                               position_low = 0x000B, speed = 0x000C;
inline constexpr std::uint16_t current = 0x0010, microstep = 0x0011, lock_current = 0x0012,
                               custom_node = 0x0013, custom_baud = 0x0014, serial_format = 0x0015,
                               eeprom_update = 0x0016, overtravel_stop = 0x0017, control_mode = 0x0018;
inline constexpr std::uint16_t start_speed = 0x0020, acceleration_time = 0x0021, deceleration_time = 0x0022,
                               maximum_speed = 0x0023, pulses_high = 0x0024, pulses_low = 0x0025,
                               terminal_move_mode = 0x0026, start = 0x0027, stop = 0x0028, enable = 0x0029,
                               alarm_clear = 0x002A, parameter_setting = 0x002B, position_clear = 0x002C;
inline constexpr std::uint16_t homing_start = 0x0030, homing_mode = 0x0031, homing_speed = 0x0032,
                               homing_search_speed = 0x0033, homing_time = 0x0034,
                               homing_positive_offset = 0x0035, homing_negative_offset = 0x0036;
inline constexpr std::uint16_t input_levels = 0x0040, first_input_function = 0x0041, output_levels = 0x004B,
                               first_output_function = 0x004C;
inline constexpr std::uint16_t segment_pulses_high = 0x0090, segment_pulses_low = 0x00A0,
                               segment_speed = 0x00B0, segment_time = 0x00C0, segment_pv_speed = 0x00E0,
                               performance = 0x0110, last = 0x0119;
inline constexpr std::uint16_t segment_rows = 16;
// SSD2608PR and ESS42-R.
inline constexpr std::uint16_t signal_polarity = 0x0010, loop_mode = 0x0012, encoder_resolution = 0x0110,
                               deviation_threshold = 0x0116, positioning_accuracy = 0x011F;
}  // namespace reg

}  // namespace axisd::yako_rtu
