// What the descriptors of the family have in common, as data (6.1, chapter 8 of the three manuals).
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "devices/descriptor.hpp"
#include "devices/released_position.hpp"
#include "devices/yako_rtu/codec.hpp"
#include "devices/yako_rtu/registers.hpp"

namespace axisd::yako_rtu {

/// 0x0020..0x0025 are what such a terminal would run with: after a MoveAbsolute to 300 mm, 300 mm further.
inline constexpr std::string_view runs_last_command =
    "it would start whatever the last command left in the drive; use segments with pt_enable or pv_enable";

/// Functions of the input terminals, in the order of their codes.
inline constexpr TerminalFunctionSpec input_functions[] = {
    {"none", 0, {}},
    {"home", 1, {}},
    {"positive_limit", 2, "negative_limit"},
    {"negative_limit", 3, "positive_limit"},
    {"motor_free", 4, {}},
    {"alarm_clear", 5, {}},
    {"pv_enable", 6, {}, true},
    {"pv_direction", 7, {}},  // turns a run that pv_enable starts; it starts none (7.4.2)
    {"stop", 8, {}},
    {"quick_stop", 9, {}},
    {"position_start", 10, {}, true, runs_last_command},
    {"speed_start", 11, {}, true, runs_last_command},
    {"jog_positive", 12, "jog_negative", true},
    {"jog_negative", 13, "jog_positive", true},
    {"homing_start", 14, {}, true},
    {"pt_enable", 15, {}, true},
    {"pin0", 16, {}},
    {"pin1", 17, {}},
    {"pin2", 18, {}},
    {"pin3", 19, {}},
    {"pin4", 20, {}},
};

/// What identifies all models of the family alike (6.1); exception 01 means a damaged frame (6.2.4).
constexpr RtuIdentification identified(RtuIdentification model) {
  model.read = {.address = reg::model, .count = 2};
  model.version = &version_text;
  model.damaged_frame = 1;
  model.microstep_register = reg::microstep;
  return model;
}

/// 0x0011 of the closed-loop models, in the order of the codes.
inline constexpr std::array<std::int32_t, 16> closed_loop_microsteps = {
    400, 800, 1600, 3200, 6400, 12800, 25600, 51200, 1000, 2000, 4000, 5000, 8000, 10000, 20000, 40000};
/// The same sorted, each once.
inline constexpr std::int32_t closed_loop_pulses_per_revolution[] = {
    400, 800, 1000, 1600, 2000, 3200, 4000, 5000, 6400, 8000, 10000, 12800, 20000, 25600, 40000, 51200};

inline constexpr std::string_view overtravel_stops[] = {"free", "quick_stop", "ignore"};
inline constexpr std::string_view loop_modes[] = {"closed", "open"};
inline constexpr std::string_view encoder_lines[] = {"1000", "2500"};
inline constexpr std::string_view home_approaches[] = {"forward", "as_searched"};

// Chapter 8. The texts hold for all models; the supply voltages do not and are left out.
inline constexpr AlarmSpec overcurrent = {
    1, "overcurrent", AlarmReset::power_cycle,
    "check the motor wiring for a short circuit, then switch the drive off and on"};
inline constexpr AlarmSpec overvoltage = {2, "overvoltage", AlarmReset::by_itself,
                                          "check the supply voltage, and braking energy fed back"};
inline constexpr AlarmSpec undervoltage = {3, "undervoltage", AlarmReset::by_itself,
                                           "check the supply voltage under load"};
inline constexpr AlarmSpec eeprom_alarm = {4, "eeprom", AlarmReset::by_command,
                                           "reset the axis; if it comes back, replace the drive"};
inline constexpr AlarmSpec position_deviation = {
    5, "position_deviation", AlarmReset::power_cycle,
    "check load, current and acceleration, then switch the drive off and on"};

inline constexpr SettingSpec overtravel_setting = {
    .key = "overtravel_stop",
    .kind = "enum",
    .choices = overtravel_stops,
    .default_value = "quick_stop",
    .description = "What the drive itself does at an active limit terminal (0x0017).",
    .object = reg::overtravel_stop};

/// The manuals do not say whether a drive that is sent 0x0020..0x0027 at once heeds the trigger among them.
inline constexpr SettingSpec one_frame_setting = {
    .key = "start_in_one_frame",
    .kind = "boolean",
    .choices = {},
    .default_value = "false",
    .description =
        "Block and trigger of a start go in one frame (0x0020..0x0027), which spares an exchange. "
        "The manual does not say that the drive starts then: first see it do so."};

/// An integer register of the performance group, left as the drive has it when not given.
constexpr SettingSpec tuning(std::string_view key, std::uint32_t address, std::int64_t minimum,
                             std::int64_t maximum, std::string_view description) {
  return {.key = key,
          .kind = "integer",
          .choices = {},
          .minimum = minimum,
          .maximum = maximum,
          .default_value = {},
          .description = description,
          .object = address};
}

/// Settings that SSD2608PR and ESS42-R have alike.
inline constexpr auto closed_loop_settings = std::to_array<SettingSpec>({
    overtravel_setting,
    one_frame_setting,
    {.key = "loop_mode",
     .kind = "enum",
     .choices = loop_modes,
     .default_value = "closed",
     .description = "Closed or open loop (0x0012). In open loop a release or quick stop loses the position.",
     .object = reg::loop_mode},
    released_position_setting,
    {.key = "encoder_resolution",
     .kind = "enum",
     .choices = encoder_lines,
     .default_value = {},
     .description = "Lines of the motor's encoder (0x0110); left as the drive has it when not given.",
     .object = reg::encoder_resolution},
    {.key = "home_approach",
     .kind = "enum",
     .choices = home_approaches,
     .default_value = "forward",
     .description = "Last approach of home_positive and home_negative: the manual says always forward (7.5), "
                    "its sister's in the direction of the search. With forward they cannot be mirrored."},
    {.key = "model_code",
     .kind = "integer",
     .choices = {},
     .minimum = 0,
     .maximum = 65535,
     .default_value = "0",
     .description = "Code expected in 0x0000; 0: the one that the manual prints (0x0305)."},
    tuning("closed_loop_current_percent", 0x0112, 0, 150, "Current in closed loop (0x0112), percent."),
    tuning("open_loop_current_percent", 0x0113, 0, 100, "Current in open loop (0x0113), percent."),
    tuning("lock_current_percent", 0x0114, 0, 100, "Current at standstill (0x0114), percent."),
    tuning("deviation_alarm_threshold", reg::deviation_threshold, 0, 20000,
           "Position deviation that raises alarm 5 (0x0116); the manual gives no unit."),
    tuning("in_position_threshold", 0x0117, 1, 4000,
           "When the drive reports in position (0x0117); the manual gives no unit."),
    tuning("input_filter_x0_x1", 0x0137, 0, 65535, "Filter of X0 and X1 (0x0137); 10 is 10 ms."),
    tuning("input_filter_x2_x3", 0x0138, 0, 65535, "Filter of X2 and X3 (0x0138)."),
});

}  // namespace axisd::yako_rtu
