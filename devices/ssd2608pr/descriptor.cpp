// What the SSD2608PR is, as data (manual V1.0; sections as noted).
#include "devices/descriptor.hpp"

#include <algorithm>
#include <array>

#include "devices/ssd2608pr/parameters.hpp"
#include "devices/yako_rtu/drive.hpp"
#include "devices/yako_rtu/tables.hpp"
#include "devices/yako_rtu/transactions.hpp"

namespace axisd::ssd2608pr {

std::span<const DriveDescriptor> descriptors();

namespace {

// 4.4: DIP switches SW6, SW7; 6.1 register 0x0014 for the custom ones.
constexpr std::int32_t bauds[] = {9600, 14400, 19200, 38400, 115200, 128000, 256000};
constexpr std::int32_t custom_bauds[] = {9600, 14400, 128000, 256000};

// 6.1, bits of 0x0008 and 0x0009.
constexpr TerminalSpec inputs[] = {{"X0"}, {"X1"}, {"X2"}, {"X3"}, {"X4"}};
constexpr TerminalSpec outputs[] = {{"Y0"}, {"Y1"}, {"Y2"}};

// 6.1, registers 0x004C..0x004E.
constexpr TerminalFunctionSpec output_functions[] = {
    {"none", 0, {}},  {"alarm", 1, {}},       {"running", 2, {}},
    {"homed", 3, {}}, {"in_position", 4, {}}, {"pt_mode", 5, {}},
};

constexpr AlarmSpec alarms[] = {yako_rtu::overcurrent, yako_rtu::overvoltage, yako_rtu::undervoltage,
                                yako_rtu::eeprom_alarm, yako_rtu::position_deviation};

constexpr std::uint16_t model_codes[] = {0x0305};

constexpr std::string_view terminal_registers[] = {"table", "wiring"};
constexpr auto settings = [] {
  std::array<SettingSpec, yako_rtu::closed_loop_settings.size() + 2> all{};
  auto end = std::ranges::copy(yako_rtu::closed_loop_settings, all.begin()).out;
  *end++ = yako_rtu::tuning("input_filter_x4", 0x0139, 0, 65535, "Filter of X4 (0x0139).");
  *end = {.key = "terminal_registers",
          .kind = "enum",
          .choices = terminal_registers,
          .default_value = "table",
          .description =
              "Where the functions of X0..X4 are: 0x0041 as the table of 6.1 says, or 0x0043 as the "
              "wiring example of 4.3 does."};
  return all;
}();

std::unique_ptr<Drive> make(DriveContext context) {
  static const yako_rtu::Model model{
      .descriptor = descriptors().data(),
      .first_input_function = 0x0041,
      .first_input_function_of_wiring = 0x0043,
      .custom_bauds = custom_bauds,
      .custom_node_switches = "all address switches off",
      .custom_baud_switches = "SW6 and SW7 on",
  };
  return yako_rtu::make_drive(model, std::move(context));
}

}  // namespace

std::span<const DriveDescriptor> descriptors() {
  static const DriveDescriptor models[] = {{
      .model = "ssd2608pr",
      .title = "YAKO SSD2608PR, closed-loop stepper drive",
      .bus = BusKind::modbus_rtu,
      .bauds = bauds,
      .minimum_node = 1,
      .maximum_node = 127,
      .inputs = inputs,
      .outputs = outputs,
      .input_functions = yako_rtu::input_functions,
      .output_functions = output_functions,
      .parameters = parameters(),
      .alarms = alarms,
      .settings = settings,
      // Five inputs: one enables, four select (7.3.2 prints 16 all the same).
      .capabilities = {.pulses_per_revolution = yako_rtu::closed_loop_pulses_per_revolution,
                       .maximum_segments = 15,
                       .minimum_segment_time_ms = 0,
                       .home_approach_mirrors = false,
                       .position_source = PositionSource::unspecified,
                       .closed_loop = true,
                       .communication_watchdog = false},
      // The ESS42-R has the same code, and no Y2.
      .identification = yako_rtu::identified({.model_codes = model_codes,
                                              .has_register = 0x004E,
                                              .microstep_codes = yako_rtu::closed_loop_microsteps}),
      .rtu_transactions = yako_rtu::transactions,
      .make = &make,
  }};
  return models;
}

}  // namespace axisd::ssd2608pr
