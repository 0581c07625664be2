#include "api/server/drive_convert.hpp"

#include <algorithm>
#include <span>
#include <string>
#include <utility>

#include "api/server/convert.hpp"
#include "api/server/parameter_type.hpp"

namespace axisd::server {
namespace {

// Every model that homes has all four.
constexpr const char* homing_methods[] = {"home_positive", "home_negative", "positive_limit",
                                          "negative_limit"};

void add_homing_methods(const Capabilities& capabilities, v1::GetDriveResponse& to) {
  if (!capabilities.homing) return;
  for (const auto* method : homing_methods) to.add_homing_methods(method);
  for (const auto& one : capabilities.homing_numbers) to.add_homing_methods(std::to_string(int{one.number}));
}

/// The functions in the order of the drive's codes, as the contract promises.
void add_terminals(std::span<const TerminalSpec> terminals, std::span<const TerminalFunctionSpec> functions,
                   google::protobuf::RepeatedPtrField<v1::TerminalCapability>& to) {
  std::vector<TerminalFunctionSpec> ordered(functions.begin(), functions.end());
  std::ranges::sort(ordered, {}, &TerminalFunctionSpec::code);
  for (const auto& terminal : terminals) {
    auto& capability = *to.Add();
    capability.set_name(std::string(terminal.name));
    for (const auto& function : ordered)
      if (terminal.function.empty() || function.name == terminal.function ||
          function.mirror == terminal.function)  // on an inverted axis
        capability.add_functions(std::string(function.name));
  }
}

void to_proto(const AlarmSpec& from, v1::AlarmDescription& to) {
  to.set_code(from.code);
  to.set_name(std::string(from.name));
  to.set_reset(server::to_proto(from.reset));
  to.set_remedy(std::string(from.remedy));
}

void to_proto(const Capabilities& from, v1::GetDriveResponse& to) {
  to.set_closed_loop(from.closed_loop);
  to.set_communication_watchdog(from.communication_watchdog);
  to.set_position_source(server::to_proto(from.position_source));
  for (const auto pulses : from.pulses_per_revolution)
    to.add_pulses_per_revolution(static_cast<std::uint32_t>(pulses));
  to.set_maximum_rpm(static_cast<std::uint32_t>(from.maximum_rpm));
  to.set_maximum_pulse_rate_hz(static_cast<std::uint32_t>(from.maximum_pulse_rate_hz));
  to.set_maximum_segments(static_cast<std::uint32_t>(from.maximum_segments));
}

}  // namespace

v1::ParameterAccess to_proto(Access access) {
  return static_cast<v1::ParameterAccess>(std::to_underlying(access) + 1);
}
v1::AlarmReset to_proto(AlarmReset reset) {
  return static_cast<v1::AlarmReset>(std::to_underlying(reset) + 1);
}
v1::SerialPhase to_proto(SerialProgress::Phase phase) {
  return static_cast<v1::SerialPhase>(std::to_underlying(phase) + 1);
}
static_assert(std::to_underlying(Access::wo) + 1 == v1::ParameterAccess_MAX);
static_assert(std::to_underlying(AlarmReset::by_command) + 1 == v1::AlarmReset_MAX);
static_assert(std::to_underlying(SerialProgress::Phase::verified) + 1 == v1::SerialPhase_MAX);

void to_proto(const ParameterSpec& from, std::string_view configured_by, v1::Parameter& to) {
  to.set_name(std::string(from.name));
  to.set_address(from.address);
  to.set_type(to_proto(from.type));
  to.set_unit(std::string(from.unit));
  to.set_minimum(from.minimum);
  to.set_maximum(from.maximum);
  if (from.default_value) to.set_default_value(*from.default_value);
  to.set_access(to_proto(from.access));
  to.set_description(std::string(from.description));
  to.set_configured_by(std::string(configured_by));
  to.set_instead(std::string(from.instead));
}

void to_proto(const DriveInfo& from, v1::ListParametersResponse& to) {
  to.set_model(std::string(from.descriptor->model));
  for (const auto& spec : from.descriptor->parameters) {
    const auto key = from.configured_by.find(spec.address);
    to_proto(spec, key == from.configured_by.end() ? std::string_view() : key->second, *to.add_parameters());
  }
}

void to_proto(std::string_view axis, const DriveInfo& from, v1::GetDriveResponse& to) {
  const auto& model = *from.descriptor;
  to.set_axis(std::string(axis));
  to.set_model(std::string(model.model));
  to.set_title(std::string(model.title));
  if (from.identity) {
    to.set_model_code(from.identity->model_code);
    to.set_version(from.identity->version);
  }
  to_proto(model.capabilities, to);
  add_homing_methods(model.capabilities, to);
  add_terminals(model.inputs, model.input_functions, *to.mutable_inputs());
  add_terminals(model.outputs, model.output_functions, *to.mutable_outputs());
  for (const auto& alarm : model.alarms) to_proto(alarm, *to.add_alarms());
  for (const auto baud : model.bauds) to.add_bauds(static_cast<std::uint32_t>(baud));
  to.set_eeprom_writes(from.eeprom_writes);
  to.set_persist(from.persist);
}

void to_proto(const std::vector<ParameterValue>& from, const DriveDescriptor& model,
              google::protobuf::RepeatedPtrField<v1::ParameterValue>& to) {
  for (const auto& value : from) {
    auto& entry = *to.Add();
    const auto spec = std::ranges::find(model.parameters, value.address, &ParameterSpec::address);
    if (spec != model.parameters.end()) entry.set_name(std::string(spec->name));
    entry.set_address(value.address);
    entry.set_value(value.value);
  }
}

void to_proto(const SegmentSettings& from, v1::SegmentTable& to) {
  to.set_absolute(from.absolute);
  for (const auto& segment : from.positions) {
    auto& row = *to.add_positions();
    row.set_number(static_cast<std::uint32_t>(segment.number));
    row.set_target(segment.target);
    row.set_velocity(segment.velocity);
    to_proto(segment.acceleration_time, *row.mutable_acceleration_time());
  }
  for (const auto& segment : from.velocities) {
    auto& row = *to.add_velocities();
    row.set_number(static_cast<std::uint32_t>(segment.number));
    row.set_velocity(segment.velocity);
    to_proto(segment.acceleration_time, *row.mutable_acceleration_time());
  }
}

}  // namespace axisd::server
