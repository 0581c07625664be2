// What the YSS-C is, as data (manual V1.1; sections as noted). The five models of the series are one drive on
// five motors: nothing in their dictionary tells them apart.
#include "devices/yss_c/model.hpp"

#include <utility>

#include "devices/cia402/configuration.hpp"
#include "devices/cia402/drive.hpp"
#include "devices/released_position.hpp"
#include "devices/yako_rtu/tables.hpp"
#include "devices/yss_c/objects.hpp"
#include "devices/yss_c/parameters.hpp"

namespace axisd::yss_c {

namespace {

// 4.4: SW2 off is 1 Mbit/s, on is what 2009h says, in the order of its codes.
constexpr std::int32_t bauds[] = {1'000'000, 500'000, 250'000, 125'000, 100'000, 50'000, 25'000};
constexpr auto custom_bitrates = std::span(bauds).subspan(1);

// 7, bits of 2003h and 2004h.
constexpr TerminalSpec inputs[] = {{"X0"}, {"X1"}, {"X2"}, {"X3"}, {"X4"}, {"X5"}, {"X6"}};
constexpr TerminalSpec outputs[] = {{"Y0"}, {"Y1"}, {"Y2"}};

/// 607Ah, 60FFh and the times are what such a terminal would run with.
constexpr std::string_view runs_last_command =
    "it would start whatever the last command left in the drive; give the motion as a command";

// 7, 2030h:02..08. The RS-485 models number some functions otherwise.
constexpr TerminalFunctionSpec input_functions[] = {
    {"none", 0, {}},
    {"home", 1, {}},
    {"positive_limit", 2, "negative_limit"},
    {"negative_limit", 3, "positive_limit"},
    {"motor_enable", 4, {}, true},
    {"motor_free", 5, {}},
    {"alarm_clear", 6, {}},
    {"restore_factory",
     7,
     {},
     false,
     "it would take microstep, terminals and node-ID from a running axis; use DriveService.RestoreFactory"},
    {"stop", 8, {}},
    {"quick_stop", 9, {}},
    {"position_start", 10, {}, true, runs_last_command},
    {"speed_start", 11, {}, true, runs_last_command},
    {"jog_positive", 12, "jog_negative", true},
    {"jog_negative", 13, "jog_positive", true},
    {"homing_start", 14, {}, true},
};
// 7, 2030h:0D..0F.
constexpr TerminalFunctionSpec output_functions[] = {
    {"none", 0, {}}, {"alarm", 1, {}}, {"running", 2, {}}, {"homed", 3, {}}, {"in_position", 4, {}},
};

// Chapter 8: the same five as on the RS-485 models. 603Fh has them as FF01h..FF05h (7).
constexpr AlarmSpec alarms[] = {yako_rtu::overcurrent, yako_rtu::overvoltage, yako_rtu::undervoltage,
                                yako_rtu::eeprom_alarm, yako_rtu::position_deviation};

constexpr std::string_view overtravel_stops[] = {"free", "quick_stop"};

constexpr std::string_view status_bit_13_key = "status_bit_13";
constexpr std::string_view status_bit_13[] = {"enabled", "homing_error"};

constexpr SettingSpec settings[] = {
    {.key = "overtravel_stop",
     .kind = "enum",
     .choices = overtravel_stops,
     .default_value = "quick_stop",
     .description = "What the drive itself does at an active limit terminal (200Ah).",
     .object = object::overtravel_stop.key()},
    {.key = "loop_mode",
     .kind = "enum",
     .choices = yako_rtu::loop_modes,
     .default_value = "closed",
     .description = "Closed or open loop (2007h). In open loop a release or quick stop loses the position.",
     .object = object::loop_mode.key()},
    released_position_setting,
    {.key = "home_approach",
     .kind = "enum",
     .choices = yako_rtu::home_approaches,
     .default_value = "forward",
     .description =
         "Last approach of home_positive and home_negative: the manual says always forward (6.2.6), CiA 402 "
         "in the direction of the search. With forward they cannot be mirrored."},
    {.key = cia402::terminal_states_key,
     .kind = "enum",
     .choices = cia402::terminal_states,
     .default_value = "active",
     .description =
         "What 2003h and 2004h show: active terminals, as the maker's other drives, or the levels at "
         "them, as the manual's words can be read. Seen at an input with `active: low`."},
    {.key = status_bit_13_key,
     .kind = "enum",
     .choices = status_bit_13,
     .default_value = "enabled",
     .description =
         "What bit 13 of 6041h says: the motor is energised (6.2.2), or homing has failed (appendix, CiA "
         "402). With homing_error the state of the drive tells whether it is enabled."},
    yako_rtu::tuning("closed_loop_current_percent", 0x204200, 0, 150,
                     "Current in closed loop (2042h), percent."),
    yako_rtu::tuning("open_loop_current_percent", 0x204300, 0, 100, "Current in open loop (2043h), percent."),
    yako_rtu::tuning("lock_current_percent", 0x204400, 0, 100, "Current at standstill (2044h), percent."),
    yako_rtu::tuning("lock_current_time", 0x204500, 100, 500,
                     "Time until the current at standstill applies (2045h), ms."),
    yako_rtu::tuning("deviation_alarm_threshold", object::deviation_threshold.key(), 0, 20000,
                     "Position deviation that raises alarm 5 (2046h); the manual gives no unit."),
    yako_rtu::tuning("in_position_threshold", object::in_position_threshold.key(), 1, 4000,
                     "When the drive reports in position (2047h); the manual gives no unit."),
    yako_rtu::tuning("input_filter_x0_x1", 0x206700, 0, 65535, "Filter of X0 and X1 (2067h), ms."),
    yako_rtu::tuning("input_filter_x2_x3", 0x206800, 0, 65535, "Filter of X2 and X3 (2068h), ms."),
    yako_rtu::tuning("input_filter_x4_x5", 0x206900, 0, 65535, "Filter of X4 and X5 (2069h), ms."),
    yako_rtu::tuning("input_filter_x6", 0x206A00, 0, 65535, "Filter of X6 (206Ah), ms."),
};

// 6.2.6; chapter 7 prints the second numbers for the same object.
constexpr cia402::HomingCode homing_codes[] = {
    {.method = HomingMethod::home_positive, .code = 24, .alternative = 0},
    {.method = HomingMethod::home_negative, .code = 29, .alternative = 1},
    {.method = HomingMethod::positive_limit, .code = 18, .alternative = 2},
    {.method = HomingMethod::negative_limit, .code = 17, .alternative = 3},
};

constexpr CanIdentification identification{.vendor = 0x0100,
                                           .product = 0x0003,
                                           .device_type = 0x00040192,
                                           .microstep_object = object::microstep.key(),
                                           .microstep_codes = yako_rtu::closed_loop_microsteps};

constexpr cia402::VendorObjects objects{.moving = object::moving,
                                        .velocity = object::speed,
                                        .position_window = object::positioning_accuracy,
                                        .inputs = object::inputs,
                                        .outputs = object::outputs,
                                        .start_speed = object::start_speed,
                                        .microstep = object::microstep,
                                        .loop_mode = object::loop_mode,
                                        .eeprom_switch = object::eeprom_update,
                                        .save = cia402::MemoryCommand{object::parameter_setting, 2},
                                        .restore = cia402::MemoryCommand{object::parameter_setting, 1},
                                        .alarm_clear = object::alarm_clear,
                                        .position_clear = object::position_clear,
                                        .hardware_version = canopen::Object{0x1009, 0},
                                        .software_version = canopen::Object{0x100A, 0},
                                        .input_levels = object::input_levels,
                                        .first_input_function = object::first_input_function,
                                        .output_levels = object::output_levels,
                                        .first_output_function = object::first_output_function};

/// 6041h, 6064h and 2002h; 603Fh, 2003h, 2004h and 6061h. By SDO 2001h as well.
constexpr CanTransactionSet transactions{.state_pdos = {8, 7},
                                         .pdo_inhibit = cia402::inhibit_period,
                                         .pdo_event = cia402::event_period,
                                         .state_transfers = 8,
                                         .continuity_transfers = 5,
                                         .drift_transfers = 30,
                                         .stop_transfers = cia402::stop_transfers};

/// Bit 13 in the reading of the appendix (MC_HOME).
const cia402::Model& model_with_homing_error() {
  static const cia402::Model the_model = [] {
    auto one = model();
    one.status.homing_error = std::exchange(one.status.enabled, std::uint16_t{0});
    return one;
  }();
  return the_model;
}

std::unique_ptr<Drive> make(DriveContext context) {
  const auto& settings_of_drive = context.setup.model_settings;
  const auto reading = settings_of_drive.find(std::string(status_bit_13_key));
  const bool of_appendix =
      reading != settings_of_drive.end() && reading->second == SettingValue(std::string(status_bit_13[1]));
  return cia402::make_drive(of_appendix ? model_with_homing_error() : model(), std::move(context));
}

}  // namespace

const cia402::Model& model() {
  static const cia402::Model the_model{
      .descriptor = &descriptor(),
      .identity = {.profile = identification.profile(),
                   .vendor = identification.vendor,
                   .product = identification.product},
      .homing_codes = homing_codes,
      // 6.2.2.
      .status = {.alarm = 0x0080,
                 .homed = 0x0100,
                 .set_point_mirror = 0x0800,
                 .enabled = 0x2000,
                 .moving = 0x4000,
                 .in_position = 0x8000},
      .objects = objects,
      // 7, 603Fh (0: no alarm) and 605Dh: the drive's 0 and 1 are not those of CiA 402.
      .meaning = {.counts_per_revolution = 4000,
                  .alarm_mask = 0x00FF,
                  .alarm_prefix = 0xFF00,
                  .error_code_ends = true,
                  .halt_on_ramp = 0,
                  .halt_at_once = 1},
      .addressing = cia402::Addressing{.node = object::node,
                                       .custom_node = object::custom_node,
                                       .custom_bitrate = object::custom_baud,
                                       .custom_bitrates = custom_bitrates,
                                       .minimum_custom_node = 16,
                                       .maximum_custom_node = 127,
                                       .node_switches = "all address switches off",
                                       .bitrate_switches = "SW2 on",
                                       .factory_bitrate = "1 Mbit/s with SW2 off, 500 kbit/s with SW2 on"},
  };
  return the_model;
}

const DriveDescriptor& descriptor() {
  static const DriveDescriptor the_descriptor{
      .model = "yss-c",
      .title = "YAKO YSS-C (YSS57-C11, -C21, -C31, YSS60-C11, -C21), integrated closed-loop stepper motor",
      .bus = BusKind::canopen,
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
      .capabilities = {.pulses_per_revolution = yako_rtu::closed_loop_pulses_per_revolution,
                       .minimum_rpm = 5,
                       .maximum_search_rpm = 3000,
                       .maximum_homing_offset_pulses = 1'000'000,
                       .minimum_target_pulses = -1'000'000,
                       .maximum_target_pulses = 1'000'000,
                       .maximum_segments = 0,
                       .minimum_segment_time_ms = 0,
                       .home_approach_mirrors = false,
                       .position_source = PositionSource::encoder,
                       .closed_loop = true,
                       .communication_watchdog = false},
      // 7: 6098h..609Ah and 607Ch are RW without S, and there are no segments.
      .saves = {.terminals = true, .drive = true},
      .can_identification = identification,
      .can_transactions = transactions,
      .make = &make,
  };
  return the_descriptor;
}

}  // namespace axisd::yss_c
