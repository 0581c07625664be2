// What the ESS42-R is, as data (manual V1.0; sections as noted).
#include "devices/descriptor.hpp"

#include "devices/ess42_r/parameters.hpp"
#include "devices/yako_rtu/drive.hpp"
#include "devices/yako_rtu/tables.hpp"
#include "devices/yako_rtu/transactions.hpp"

namespace axisd::ess42_r {

std::span<const DriveDescriptor> descriptors();

namespace {

// 6.1, register 0x0014: there are no switches for it.
constexpr std::int32_t bauds[] = {9600, 19200, 38400, 115200};
constexpr std::int32_t custom_bauds[] = {115200, 38400, 19200, 9600};

// 6.1, bits of 0x0008 and 0x0009.
constexpr TerminalSpec inputs[] = {{"X0"}, {"X1"}, {"X2"}, {"X3"}};
constexpr TerminalSpec outputs[] = {{"Y0"}, {"Y1"}};

// 6.1, registers 0x004C, 0x004D.
constexpr TerminalFunctionSpec output_functions[] = {
    {"none", 0, {}}, {"alarm", 1, {}}, {"running", 2, {}}, {"homed", 3, {}}, {"in_position", 4, {}},
};

// Chapter 8 has no alarm 4.
constexpr AlarmSpec alarms[] = {yako_rtu::overcurrent, yako_rtu::overvoltage, yako_rtu::undervoltage,
                                yako_rtu::position_deviation};

constexpr std::uint16_t model_codes[] = {0x0305};

std::unique_ptr<Drive> make(DriveContext context) {
  static const yako_rtu::Model model{
      .descriptor = descriptors().data(),
      .first_input_function = 0x0043,
      .custom_bauds = custom_bauds,
      .minimum_custom_node = 1,
      .maximum_custom_node = 32,
      .custom_node_switches = "all address switches off",
      .factory_custom_node = 1,
  };
  return yako_rtu::make_drive(model, std::move(context));
}

}  // namespace

std::span<const DriveDescriptor> descriptors() {
  static const DriveDescriptor models[] = {{
      .model = "ess42-r",
      .title = "YAKO ESS42-R, integrated closed-loop stepper motor",
      .bus = BusKind::modbus_rtu,
      .bauds = bauds,
      .minimum_node = 1,
      .maximum_node = 32,
      .inputs = inputs,
      .outputs = outputs,
      .input_functions = yako_rtu::input_functions,
      .output_functions = output_functions,
      .parameters = parameters(),
      .alarms = alarms,
      .settings = yako_rtu::closed_loop_settings,
      // Four inputs: one enables, three select (note of 7.3).
      .capabilities = {.pulses_per_revolution = yako_rtu::closed_loop_pulses_per_revolution,
                       .maximum_segments = 7,
                       .minimum_segment_time_ms = 0,
                       .home_approach_mirrors = false,
                       .position_source = PositionSource::unspecified,
                       .closed_loop = true,
                       .communication_watchdog = false},
      // The SSD2608PR has the same code, and Y2.
      .identification = yako_rtu::identified({.model_codes = model_codes,
                                              .lacks_register = 0x004E,
                                              .microstep_codes = yako_rtu::closed_loop_microsteps}),
      .rtu_transactions = yako_rtu::transactions,
      .make = &make,
  }};
  return models;
}

}  // namespace axisd::ess42_r
