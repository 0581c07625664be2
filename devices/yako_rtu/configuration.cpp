#include "devices/yako_rtu/configuration.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "devices/descriptor.hpp"
#include "devices/yako_rtu/codec.hpp"
#include "devices/yako_rtu/registers.hpp"
#include "devices/ykd2405pr/settings.hpp"

namespace axisd::yako_rtu {

namespace {

const DriveDescriptor& descriptor() { return *find_drive_model("ykd2405pr"); }

template <class Range, class Projection>
std::optional<std::size_t> index_of(const Range& range, std::string_view name, Projection projection) {
  const auto found = std::ranges::find(range, name, projection);
  if (found == std::ranges::end(range)) return std::nullopt;
  return static_cast<std::size_t>(found - std::ranges::begin(range));
}

/// Function code and active level of each terminal of one side.
struct Assignment {
  std::vector<const TerminalFunctionSpec*> functions;  ///< nullptr: not named
  std::uint16_t levels = 0;
};

Result<Assignment> assign(const std::vector<TerminalSettings>& terminals, std::span<const TerminalSpec> known,
                          std::span<const TerminalFunctionSpec> functions) {
  Assignment assignment{.functions = std::vector<const TerminalFunctionSpec*>(known.size(), nullptr)};
  for (const auto& terminal : terminals) {
    const auto index = index_of(known, terminal.terminal, &TerminalSpec::name);
    const auto* function = find_function(functions, terminal.function);
    if (!index || function == nullptr)
      return fail(Reason::misconfigured, fmt::format("terminal {} cannot have the function {}",
                                                     terminal.terminal, terminal.function));
    assignment.functions[*index] = function;
    if (terminal.active_low) assignment.levels |= static_cast<std::uint16_t>(1U << *index);
  }
  return assignment;
}

void add_inputs(const Assignment& inputs, bool limits_and_stops, std::vector<RegisterSetting>& all) {
  const auto is_limit_or_stop = [](std::uint16_t code) {
    return code == 2 || code == 3 || code == 8 || code == 9;
  };
  for (std::size_t i = 0; i < inputs.functions.size(); ++i) {
    const auto* function = inputs.functions[i];
    const std::uint16_t code = function == nullptr ? 0 : function->code;
    if (is_limit_or_stop(code) != limits_and_stops) continue;
    all.push_back({.address = static_cast<std::uint16_t>(reg::first_input_function + i),
                   .value = code,
                   .starts_motion = function != nullptr && function->starts_motion,
                   .input_bit = 1U << i});
  }
}

std::optional<std::string_view> text_setting(const DriveSetup& setup, const char* key) {
  const auto found = setup.model_settings.find(key);
  if (found == setup.model_settings.end()) return std::nullopt;
  const auto* text = std::get_if<std::string>(&found->second);
  return text == nullptr || text->empty() ? std::nullopt : std::optional<std::string_view>(*text);
}

void add_choice(const DriveSetup& setup, const char* key, std::span<const std::string_view> choices,
                std::uint16_t address, std::vector<RegisterSetting>& all) {
  const auto text = text_setting(setup, key);
  if (!text) return;
  if (const auto code = index_of(choices, *text, std::identity{}))
    all.push_back({.address = address, .value = static_cast<std::uint16_t>(*code)});
}

}  // namespace

bool starts_motion(std::uint16_t function_code) {
  const auto functions = descriptor().input_functions;
  const auto found = std::ranges::find(functions, function_code, &TerminalFunctionSpec::code);
  return found != functions.end() && found->starts_motion;
}

Result<std::vector<RegisterSetting>> required_registers(const DriveSetup& setup) {
  const auto& model = descriptor();
  const auto inputs = assign(setup.inputs, model.inputs, model.input_functions);
  if (!inputs) return fail(inputs.error());
  const auto outputs = assign(setup.outputs, model.outputs, model.output_functions);
  if (!outputs) return fail(outputs.error());
  const auto microstep = std::ranges::find(ykd2405pr::microstep_codes, setup.pulses_per_revolution);
  if (microstep == ykd2405pr::microstep_codes.end())
    return fail(Reason::misconfigured, fmt::format("the drive has no microstep setting of {} pulses/rev",
                                                   setup.pulses_per_revolution));

  std::vector<RegisterSetting> all;
  all.push_back({.address = reg::eeprom_update, .value = static_cast<std::uint16_t>(setup.persist ? 0 : 1)});
  all.push_back({.address = reg::input_levels, .value = inputs->levels});
  if (!setup.outputs.empty()) all.push_back({.address = reg::output_levels, .value = outputs->levels});
  add_inputs(*inputs, true, all);
  all.push_back({.address = reg::control_mode, .value = 0});
  all.push_back({.address = reg::microstep,
                 .value = static_cast<std::uint16_t>(microstep - ykd2405pr::microstep_codes.begin())});
  static constexpr std::string_view halves[] = {"half", "full"};
  static constexpr std::string_view overtravels[] = {"free", "quick_stop", "ignore"};
  add_choice(setup, "overtravel_stop", overtravels, reg::overtravel_stop, all);
  add_choice(setup, "current", ykd2405pr::current_choices, reg::current, all);
  add_choice(setup, "lock_current", halves, reg::lock_current, all);
  if (setup.homing) {
    const auto block = encode(*setup.homing);
    for (std::size_t i = 0; i < block.size(); ++i)
      all.push_back({.address = static_cast<std::uint16_t>(reg::homing_mode + i), .value = block[i]});
  }
  for (std::size_t i = 0; i < outputs->functions.size(); ++i)
    if (const auto* function = outputs->functions[i])
      all.push_back(
          {.address = static_cast<std::uint16_t>(reg::first_output_function + i), .value = function->code});
  add_inputs(*inputs, false, all);
  return all;
}

}  // namespace axisd::yako_rtu
