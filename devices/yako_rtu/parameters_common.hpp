// The register groups of manual 6.1 that the family's models share, one function or array for each, with the
// corrections of all three manuals (other chapters contradict 6.1): 0x0027 is write-only (6.2.4);
// 0x0028..0x002C print the same "-" as default and are commands, so write-only as well; 0x0030 is printed RO,
// but 7.6.3 writes it; 0x0024/0x0025 are the halves of one signed 32-bit number, so any word is allowed
// (their own example: 0x86A0).
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "devices/descriptor.hpp"
#include "devices/yako_rtu/parameters_segments.hpp"

namespace axisd::yako_rtu {

/// Where the status groups of the models differ.
struct StatusGroup {
  std::int32_t model_code;
  std::string_view model_text, alarm_text, inputs_text, outputs_text;
};

// clang-format off

/// Status, 0x0000..0x000C.
consteval auto status_rows(const StatusGroup& model) {
  using enum Access;
  return std::to_array<ParameterSpec>({
    {0x0000, "model_code", ro, 0, 65535, model.model_code, "", model.model_text},
    {0x0001, "version", ro, 0, 65535, 0x100, "", "Firmware version, 0x0100 is V1.0"},
    {0x0002, "node", ro, 1, 127, {}, "", "Modbus address in use"},
    {0x0003, "mode", ro, 0, 3, {}, "",
     "0 position or speed, 1 homing, 2 multi-position (PT), 3 multi-speed (PV)"},
    {0x0004, "moving", ro, 0, 1, {}, "", "0 at standstill, 1 moving"},
    {0x0005, "direction", ro, 0, 1, {}, "", "0 counter-clockwise (positive), 1 clockwise (negative)"},
    {0x0006, "alarm", ro, 0, 5, {}, "", model.alarm_text},
    {0x0007, "status", ro, 0, 65535, {}, "",
     "Bit 0 in position, 1 homing done, 2 moving, 3 alarm, 4 released (0: enabled)"},
    {0x0008, "inputs", ro, 0, 65535, {}, "", model.inputs_text},
    {0x0009, "outputs", ro, 0, 65535, {}, "", model.outputs_text},
    {0x000A, "position_high", ro, 0, 65535, {}, "pulse",
     "Position counter, high word of a signed 32-bit number"},
    {0x000B, "position_low", ro, 0, 65535, {}, "pulse", "Position counter, low word"},
    {0x000C, "speed", ro, -3000, 3000, {}, "r/min", "Present speed", {}, ParameterType::i16},
  });
}

/// Custom address and bit rate of the models with eight DIP switches, 0x0013 and 0x0014.
inline constexpr auto custom_serial_rows = std::to_array<ParameterSpec>({
    {0x0013, "custom_node", Access::rw_saved, 0, 127, 0, "",
     "Modbus address above 31, used with all address switches off; 0..31 undefined"},
    {0x0014, "custom_baud", Access::rw_saved, 0, 3, 0, "",
     "0 9600, 1 14400, 2 128000, 3 256000 bit/s, used with SW6 and SW7 on; from the next power-up"},
});

/// 0x0015 and 0x0016.
inline constexpr auto format_and_eeprom_rows = std::to_array<ParameterSpec>({
    {0x0015, "serial_format", Access::rw_saved, 0, 3, 0, "",
     "0 8N1, 1 8N2, 2 8E1, 3 8O1; from the next power-up"},
    {0x0016, "eeprom_update", Access::rw_saved, 0, 1, 0, "",
     "0: every write to a saved register goes to EEPROM as well, 1: it does not"},
});

/// Control 2, 0x0020..0x002C. The range printed for 0x0028 differs, its meaning (bit 0) does not.
consteval auto motion_rows(std::int32_t maximum_stop) {
  using enum Access;
  return std::to_array<ParameterSpec>({
    {0x0020, "start_speed", rw, 2, 300, 5, "r/min", "Speed at which a motion begins"},
    {0x0021, "acceleration_time", rw, 0, 2000, 100, "ms", "Time from start speed to maximum speed"},
    {0x0022, "deceleration_time", rw, 0, 2000, 100, "ms",
     "Time from maximum speed to start speed; a stop uses the value set before its motion"},
    {0x0023, "maximum_speed", rw, -3000, 3000, 60, "r/min",
     "Speed of the motion; its sign is the direction in speed mode; at most 200 kHz of pulses", {},
     ParameterType::i16},
    {0x0024, "pulses_high", rw, -32768, 65535, 0, "pulse",
     "Distance or target, high word of a signed 32-bit number"},
    {0x0025, "pulses_low", rw, -32768, 65535, 5000, "pulse", "Distance or target, low word"},
    {0x0026, "terminal_move_mode", rw, 0, 1, 0, "",
     "Position moves started by terminals: 0 relative, 1 absolute"},
    {0x0027, "start", wo, 0, 6, {}, "", "Starts: 1 relative position, 5 absolute position, 2 speed",
     "AxisService.MoveAbsolute"},
    {0x0028, "stop", wo, 0, maximum_stop, {}, "", "Stops: bit 0 = 0 with deceleration, 1 at once",
     "AxisService.Stop"},
    {0x0029, "enable", wo, 0, 1, {}, "", "0 releases the motor, 1 enables it", "AxisService.Enable"},
    {0x002A, "alarm_clear", wo, 0, 1, {}, "", "1 clears an alarm that can be cleared", "AxisService.Reset"},
    {0x002B, "parameter_setting", wo, 0, 2, {}, "",
     "1 restores the factory settings, 2 saves all RW registers to EEPROM",
     "DriveService.SaveParameters or DriveService.RestoreFactory"},
    {0x002C, "position_clear", wo, 0, 1, {}, "", "1 sets the position counter to 0",
     "AxisService.SetPosition"},
  });
}

/// Homing, 0x0030..0x0036.
inline constexpr auto homing_rows = std::to_array<ParameterSpec>({
    {0x0030, "homing_start", Access::wo, 0, 1, {}, "",
     "1 starts homing (printed RO, but 7.6.3 writes it)", "AxisService.Home"},
    {0x0031, "homing_mode", Access::rw_saved, 0, 3, 0, "",
     "0 home switch forwards, 1 home switch backwards, 2 positive limit, 3 negative limit"},
    {0x0032, "homing_speed", Access::rw_saved, 5, 3000, 120, "r/min", "Speed until the switch is found"},
    {0x0033, "homing_search_speed", Access::rw_saved, 5, 300, 60, "r/min",
     "Speed after the switch was found"},
    {0x0034, "homing_time", Access::rw_saved, 30, 2000, 100, "ms",
     "Acceleration and deceleration time of homing"},
    {0x0035, "homing_positive_offset", Access::rw_saved, 0, 65535, 0, "pulse",
     "Distance moved forwards after the switch"},
    {0x0036, "homing_negative_offset", Access::rw_saved, 0, 65535, 0, "pulse",
     "Distance moved backwards after the switch"},
});

// clang-format on

/// What the values of an input's function register mean, alike on all models.
inline constexpr std::string_view input_function_text =
    "Function of the input: 0 none, 1 home, 2 positive limit, 3 negative limit, 4 motor free, 5 alarm clear, "
    "6 PV enable, 7 PV direction, 8 stop, 9 quick stop, 10 position start, 11 speed start, 12 JOG+, 13 JOG-, "
    "14 homing start, 15 PT enable, 16 PIN0, 17 PIN1, 18 PIN2, 19 PIN3, 20 PIN4";

}  // namespace axisd::yako_rtu
