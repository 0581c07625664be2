#include "devices/yako_rtu/configuration.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "devices/setup_codes.hpp"
#include "devices/yako_rtu/codec.hpp"
#include "devices/yako_rtu/registers.hpp"

namespace axisd::yako_rtu {

namespace {

void add_inputs(const TerminalAssignment& inputs, std::span<const TerminalSpec> terminals,
                std::uint16_t first, bool limits_and_stops, bool saved, std::vector<RegisterSetting>& all) {
  for (std::size_t i = 0; i < inputs.functions.size(); ++i) {
    const auto* function = inputs.functions[i];
    if (is_limit_or_stop(function) != limits_and_stops) continue;
    all.push_back({.address = static_cast<std::uint16_t>(first + i),
                   .value = function == nullptr ? std::uint16_t{0} : function->code,
                   .key = fmt::format("inputs.{}", terminals[i].name),
                   .saved = saved,
                   .starts_motion = function != nullptr && function->starts_motion,
                   .input_bits = 1U << i});
  }
}

void add_outputs(const TerminalAssignment& outputs, std::span<const TerminalSpec> terminals, bool saved,
                 std::vector<RegisterSetting>& all) {
  for (std::size_t i = 0; i < outputs.functions.size(); ++i)
    if (const auto* function = outputs.functions[i])
      all.push_back({.address = static_cast<std::uint16_t>(reg::first_output_function + i),
                     .value = function->code,
                     .key = fmt::format("outputs.{}", terminals[i].name),
                     .saved = saved});
}

/// Settings that the model's descriptor ties to a register: a choice's index, a number, or 0 and 1.
void add_settings(const DriveDescriptor& model, const DriveSetup& setup, std::vector<RegisterSetting>& all) {
  for (const auto& spec : model.settings) {
    const auto found = setup.model_settings.find(std::string(spec.key));
    if (found == setup.model_settings.end()) continue;
    const auto code = code_of(spec, found->second);
    if (code)
      all.push_back({.address = static_cast<std::uint16_t>(*spec.object),
                     .value = static_cast<std::uint16_t>(*code),
                     .key = fmt::format("drive.{}", spec.key),
                     .saved = setup.persist.drive});
  }
}

void add_homing(const DriveSetup& setup, std::vector<RegisterSetting>& all) {
  static constexpr std::string_view keys[] = {"method", "velocity", "search_velocity", "acceleration_time",
                                              "offset", "offset"};
  const auto block = encode(*setup.homing);
  for (std::size_t i = 0; i < block.size(); ++i)
    all.push_back({.address = static_cast<std::uint16_t>(reg::homing_mode + i),
                   .value = block.at(i),
                   .key = fmt::format("homing.{}", keys[i]),
                   .saved = setup.persist.homing});
}

}  // namespace

std::uint16_t first_input_function(const Model& model, const DriveSetup& setup) {
  const auto found = setup.model_settings.find("terminal_registers");
  const auto* reading =
      found == setup.model_settings.end() ? nullptr : std::get_if<std::string>(&found->second);
  const bool wiring = reading != nullptr && *reading == "wiring" && model.first_input_function_of_wiring != 0;
  return wiring ? model.first_input_function_of_wiring : model.first_input_function;
}

std::uint32_t segment_enables(const Model& model, const DriveSetup& setup) {
  std::uint32_t bits = 0;
  for (const auto& input : setup.inputs)
    if (input.function == "pt_enable" || input.function == "pv_enable")
      bits |= terminal_bit(model.descriptor->inputs, input.terminal).value_or(1U << 31U);
  return bits;
}

std::vector<RegisterSetting> segment_registers(const DriveSegments& segments, std::uint32_t enables) {
  std::vector<RegisterSetting> all{{.address = reg::terminal_move_mode,
                                    .value = static_cast<std::uint16_t>(segments.absolute ? 1 : 0),
                                    .key = "segments.mode",
                                    .starts_motion = true,
                                    .input_bits = enables}};
  const auto add = [&](std::uint16_t first, std::size_t row, std::int64_t value) {
    all.push_back({.address = static_cast<std::uint16_t>(first + row),
                   .value = static_cast<std::uint16_t>(value & 0xFFFF),
                   .key = "segments",
                   .starts_motion = true,
                   .input_bits = enables});
  };
  // Also those that the inputs cannot select.
  auto rows = segments.rows;
  rows.resize(reg::segment_rows);
  for (std::size_t i = 0; i < rows.size(); ++i) add(reg::segment_pulses_high, i, rows.at(i).pulses >> 16);
  for (std::size_t i = 0; i < rows.size(); ++i) add(reg::segment_pulses_low, i, rows.at(i).pulses);
  for (std::size_t i = 0; i < rows.size(); ++i)
    // Printed 30..2000 with the default 0, which cannot be written back: rows without motion keep theirs.
    if (rows.at(i).velocity_rpm != 0 || rows.at(i).pv_velocity_rpm != 0)
      add(reg::segment_time, i, rows.at(i).acceleration_time / std::chrono::milliseconds(1));
  // Last, so that a row can be started only when all of it is there.
  for (std::size_t i = 0; i < rows.size(); ++i) add(reg::segment_speed, i, rows.at(i).velocity_rpm);
  for (std::size_t i = 0; i < rows.size(); ++i) add(reg::segment_pv_speed, i, rows.at(i).pv_velocity_rpm);
  return all;
}

Result<std::vector<RegisterSetting>> required_registers(const Model& model, const DriveSetup& setup) {
  const auto& descriptor = *model.descriptor;
  const auto inputs = assign_terminals(setup.inputs, descriptor.inputs, descriptor.input_functions);
  if (!inputs) return fail(inputs.error());
  const auto outputs = assign_terminals(setup.outputs, descriptor.outputs, descriptor.output_functions);
  if (!outputs) return fail(outputs.error());
  const auto codes = descriptor.identification.microstep_codes;
  const auto microstep = std::ranges::find(codes, setup.pulses_per_revolution);
  if (microstep == codes.end())
    return fail(Reason::misconfigured, fmt::format("the drive has no microstep setting of {} pulses/rev",
                                                   setup.pulses_per_revolution));

  const auto first = first_input_function(model, setup);
  const bool terminals_saved = setup.persist.terminals;
  std::vector<RegisterSetting> all;
  all.push_back({.address = reg::input_levels,
                 .value = static_cast<std::uint16_t>(inputs->levels),
                 .key = "inputs",
                 .saved = terminals_saved});
  if (!setup.outputs.empty())
    all.push_back({.address = reg::output_levels,
                   .value = static_cast<std::uint16_t>(outputs->levels),
                   .key = "outputs",
                   .mask = static_cast<std::uint16_t>(outputs->named),
                   .saved = terminals_saved});
  add_inputs(*inputs, descriptor.inputs, first, true, terminals_saved, all);
  all.push_back({.address = reg::microstep,
                 .value = static_cast<std::uint16_t>(microstep - codes.begin()),
                 .key = "scale.microstep",
                 .saved = setup.persist.drive});
  add_settings(descriptor, setup, all);
  if (setup.homing) add_homing(setup, all);
  add_outputs(*outputs, descriptor.outputs, terminals_saved, all);
  add_inputs(*inputs, descriptor.inputs, first, false, terminals_saved, all);
  if (setup.segments) {
    for (auto& row : segment_registers(*setup.segments, segment_enables(model, setup))) {
      row.saved = setup.persist.segments;
      all.push_back(std::move(row));
    }
  }
  return all;
}

}  // namespace axisd::yako_rtu
