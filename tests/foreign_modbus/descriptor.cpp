// What the loader, the schema, the budget, the scan and the axis have to know of the ACME S1.
#include "devices/descriptor.hpp"

#include <fmt/format.h>

#include <string>
#include <utility>

#include "tests/foreign_modbus/drive.hpp"
#include "tests/foreign_modbus/registers.hpp"

namespace axisd::acme_s1 {

std::span<const DriveDescriptor> descriptors();

namespace {

constexpr std::int32_t bauds[] = {19200, 38400, 57600, 115200};
constexpr TerminalSpec inputs[] = {{"I1"}, {"I2"}};
constexpr TerminalFunctionSpec input_functions[] = {{"none", function::none, {}},
                                                    {"home", function::home, {}}};
constexpr AlarmSpec alarms[] = {
    {0x2310, "overcurrent", AlarmReset::by_command, "check the motor wiring"},
    {0x8611, "following_error", AlarmReset::by_command, "check load and acceleration"},
};
constexpr ParameterSpec parameters[] = {
    {reg::identity, "serial_number", Access::ro, 0, 65535, std::nullopt, "", "Serial number."},
    {reg::counts, "counts", Access::rw_saved, counts_per_revolution, counts_per_revolution,
     counts_per_revolution, "", "Counts per revolution."},
};
constexpr std::int32_t pulses_per_revolution[] = {counts_per_revolution};
constexpr std::uint16_t model_codes[] = {model_code};

/// Tag, profile, command.
constexpr ExchangeSize start_chain[] = {reading(tag_count), writing(profile_count), {}};
constexpr ExchangeSize watched[] = {reading(3)};

std::string version_text(std::span<const std::uint16_t> identity) {
  return fmt::format("{}.{:02}", identity[2] / 100, identity[2] % 100);
}

std::unique_ptr<Drive> make(DriveContext context) { return std::make_unique<ServoDrive>(std::move(context)); }

}  // namespace

std::span<const DriveDescriptor> descriptors() {
  static const DriveDescriptor models[] = {{
      .model = "acme-s1",
      .title = "ACME S1, servo drive",
      .bus = BusKind::modbus_rtu,
      .bauds = bauds,
      .minimum_node = 1,
      .maximum_node = 247,
      .inputs = inputs,
      .outputs = {},
      .input_functions = input_functions,
      .output_functions = {},
      .parameters = parameters,
      .alarms = alarms,
      .settings = {},
      .capabilities = {.pulses_per_revolution = pulses_per_revolution,
                       .maximum_rpm = 3000,
                       .maximum_pulse_rate_hz = 500'000,
                       .minimum_start_rpm = 0,
                       .maximum_start_rpm = 0,
                       .maximum_time_ms = 10'000,
                       .minimum_homing_rpm = 1,
                       .minimum_search_rpm = 1,
                       .maximum_homing_offset_pulses = 0,
                       .homing_ramp = false,
                       .maximum_segments = 0,
                       .position_source = PositionSource::encoder,
                       .closed_loop = true},
      .saves = {},
      .identification = {.read = {.address = reg::identity, .count = identity_count},
                         .code_at = 1,
                         .model_codes = model_codes,
                         .version = &version_text,
                         .has_register = reg::second_input,
                         .damaged_frame = exception::damaged_frame},
      .rtu_transactions = {.state = reading(state_count),
                           .continuity = reading(tag_count),
                           .start = start_chain,
                           .drift = watched,
                           .drift_of_segments = {},
                           .stop = {},
                           .longest = reading(state_count)},
      .make = &make,
  }};
  return models;
}

}  // namespace axisd::acme_s1
