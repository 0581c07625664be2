// The YSS-C's own objects by their names (manual V1.1, chapter 7), beside those of CiA 301 and CiA 402. The
// only thing that driver and simulator share, with the parameter table.
#pragma once

#include <cstddef>

#include "buses/canopen/object.hpp"

namespace axisd::yss_c::object {

using canopen::Object;

// 2000h..2012h: state, settings, commands.
inline constexpr Object node{0x2000, 0}, moving{0x2001, 0}, speed{0x2002, 0}, inputs{0x2003, 0},
    outputs{0x2004, 0};
inline constexpr Object pulse_polarity{0x2005, 0}, microstep{0x2006, 0}, loop_mode{0x2007, 0},
    custom_node{0x2008, 0}, custom_baud{0x2009, 0}, overtravel_stop{0x200A, 0}, eeprom_update{0x200C, 0};
inline constexpr Object start_speed{0x200E, 0}, enable{0x200F, 0}, parameter_setting{0x2010, 0},
    alarm_clear{0x2011, 0}, position_clear{0x2012, 0};

// 2030h: terminals. Functions of X0..X6 are 02h..08h, of Y0..Y2 0Dh..0Fh.
inline constexpr Object input_levels{0x2030, 0x01}, first_input_function{0x2030, 0x02},
    output_levels{0x2030, 0x0C}, first_output_function{0x2030, 0x0D};
inline constexpr std::size_t input_count = 7, output_count = 3;

// 2042h..206Ah: currents, control loops, filters.
inline constexpr Object closed_loop_current{0x2042, 0}, deviation_threshold{0x2046, 0},
    in_position_threshold{0x2047, 0}, positioning_accuracy{0x204F, 0}, last_gain{0x2066, 0},
    first_filter{0x2067, 0}, last_filter{0x206A, 0};

// CiA 402, with the vendor's ranges and units.
inline constexpr Object error_code{0x603F, 0}, control_word{0x6040, 0}, status_word{0x6041, 0},
    halt_option{0x605D, 0}, mode{0x6060, 0}, mode_display{0x6061, 0}, position{0x6064, 0},
    target_pulses{0x607A, 0}, homing_offset{0x607C, 0}, maximum_speed{0x6081, 0},
    acceleration_time{0x6083, 0}, deceleration_time{0x6084, 0}, homing_method{0x6098, 0},
    homing_speed{0x6099, 1}, homing_search_speed{0x6099, 2}, homing_time{0x609A, 0}, target_speed{0x60FF, 0};

}  // namespace axisd::yss_c::object
