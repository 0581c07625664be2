// What the YKD2405PR is, as data (manual V1.3; sections as noted).
#include "devices/descriptor.hpp"

#include "devices/yako_rtu/drive.hpp"
#include "devices/ykd2405pr/parameters.hpp"
#include "devices/ykd2405pr/settings.hpp"

namespace axisd::ykd2405pr {

namespace {

// 4.4: DIP switches SW6, SW7; 6.1 register 0x0014 for the custom ones.
constexpr std::int32_t bauds[] = {9600, 14400, 19200, 38400, 115200, 128000, 256000};

// 6.1, bits of 0x0008: PU and DR come first.
constexpr TerminalSpec inputs[] = {{"PU"}, {"DR"}, {"X0"}, {"X1"}, {"X2"},
                                   {"X3"}, {"X4"}, {"X5"}, {"X6"}, {"X7"}};
constexpr TerminalSpec outputs[] = {{"Y0"}, {"Y1"}, {"Y2"}, {"Y3"}};

// 6.1, registers 0x0041..0x004A.
constexpr TerminalFunctionSpec input_functions[] = {
    {"none", 0, {}},
    {"home", 1, {}},
    {"positive_limit", 2, "negative_limit"},
    {"negative_limit", 3, "positive_limit"},
    {"motor_free", 4, {}},
    {"alarm_clear", 5, {}},
    {"pv_enable", 6, {}, true},
    {"pv_direction", 7, {}, true},
    {"stop", 8, {}},
    {"quick_stop", 9, {}},
    {"position_start", 10, {}, true},
    {"speed_start", 11, {}, true},
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

// 6.1, registers 0x004C..0x004F.
constexpr TerminalFunctionSpec output_functions[] = {
    {"none", 0, {}},  {"alarm", 1, {}},       {"brake", 2, {}},   {"running", 3, {}},
    {"homed", 4, {}}, {"in_position", 5, {}}, {"pt_mode", 6, {}},
};

// Chapter 8.
constexpr AlarmSpec alarms[] = {
    {1, "overcurrent", AlarmReset::power_cycle,
     "check the motor wiring for a short circuit, then switch the drive off and on"},
    {2, "overvoltage", AlarmReset::by_itself, "check the supply voltage (at most 50 V DC)"},
    {3, "undervoltage", AlarmReset::by_itself, "check the supply voltage (at least 18 V DC)"},
    {4, "eeprom", AlarmReset::by_command, "reset the axis; if it comes back, replace the drive"},
    {5, "position_deviation", AlarmReset::power_cycle,
     "check load and current setting, then switch the drive off and on"},
};

// 6.1, register 0x0011, sorted by value; microstep_codes() has the register's codes.
constexpr std::int32_t pulses_per_revolution[] = {200,  400,  800,  1000,  1600,  2000,  3200,  4000,
                                                  5000, 6400, 8000, 10000, 12800, 20000, 25600, 40000};

constexpr std::string_view lock_currents[] = {"half", "full"};
constexpr std::string_view overtravel_stops[] = {"free", "quick_stop", "ignore"};

const SettingSpec settings[] = {
    {.key = "current",
     .kind = "enum",
     .choices = current_choices,
     .default_value = {},
     .description = "Motor current, RMS (0x0010); left as the drive has it when not given."},
    {.key = "lock_current",
     .kind = "enum",
     .choices = lock_currents,
     .default_value = {},
     .description = "Current at standstill, of the motor current (0x0012); left alone when not given."},
    {.key = "overtravel_stop",
     .kind = "enum",
     .choices = overtravel_stops,
     .default_value = "quick_stop",
     .description = "What the drive itself does at an active limit terminal (0x0017)."},
    {.key = "model_code",
     .kind = "integer",
     .minimum = 0,
     .maximum = 65535,
     .default_value = "0",
     .description = "Code expected in 0x0000; 0 accepts both that the manual prints (0x0301, 0x0302)."},
};

const DriveDescriptor models[] = {{
    .model = "ykd2405pr",
    .title = "YAKO YKD2405PR, open-loop stepper drive",
    .bus = BusKind::modbus_rtu,
    .bauds = bauds,
    .minimum_node = 1,
    .maximum_node = 127,
    .inputs = inputs,
    .outputs = outputs,
    .input_functions = input_functions,
    .output_functions = output_functions,
    .parameters = parameters(),
    .alarms = alarms,
    .settings = settings,
    .capabilities = {.pulses_per_revolution = pulses_per_revolution,
                     .position_source = PositionSource::commanded,
                     .closed_loop = false,
                     .communication_watchdog = false},
    .make = &yako_rtu::make_drive,
}};

}  // namespace

std::span<const DriveDescriptor> descriptors() { return models; }

}  // namespace axisd::ykd2405pr
