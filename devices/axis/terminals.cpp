#include "devices/axis/terminals.hpp"

#include <algorithm>
#include <span>
#include <string>

namespace axisd {

namespace {

std::vector<TerminalState> terminal_states(std::span<const TerminalSpec> terminals,
                                           const std::vector<TerminalSettings>& settings,
                                           std::uint32_t bits) {
  std::vector<TerminalState> states;
  states.reserve(terminals.size());
  for (std::size_t i = 0; i < terminals.size(); ++i) {
    const auto configured = std::ranges::find(settings, terminals[i].name, &TerminalSettings::terminal);
    states.push_back({.name = std::string(terminals[i].name),
                      .function = configured == settings.end() ? std::string() : configured->function,
                      .active = ((bits >> i) & 1U) != 0});
  }
  return states;
}

}  // namespace

bool Terminals::has(std::string_view function) const {
  return std::ranges::find(settings_->inputs, function, &TerminalSettings::function) !=
         settings_->inputs.end();
}

bool Terminals::active(const DriveSample& sample, std::string_view function) const {
  return std::ranges::any_of(settings_->inputs, [&](const TerminalSettings& input) {
    return input.function == function && active(sample, input);
  });
}

bool Terminals::active(const DriveSample& sample, const TerminalSettings& input) const {
  const auto terminal = std::ranges::find(descriptor_->inputs, input.terminal, &TerminalSpec::name);
  const auto bit = static_cast<unsigned>(terminal - descriptor_->inputs.begin());
  return terminal != descriptor_->inputs.end() && ((sample.inputs >> bit) & 1U) != 0;
}

bool Terminals::starts_motion(const TerminalSettings& input) const {
  const auto* function = find_function(descriptor_->input_functions, input.function);
  return function != nullptr && function->starts_motion;
}

bool Terminals::may_start_motion() const {
  return std::ranges::any_of(settings_->inputs,
                             [this](const TerminalSettings& input) { return starts_motion(input); });
}

bool Terminals::start_active(const DriveSample& sample) const {
  return std::ranges::any_of(settings_->inputs, [&](const TerminalSettings& input) {
    return starts_motion(input) && active(sample, input);
  });
}

std::vector<TerminalState> Terminals::inputs(std::uint32_t bits) const {
  auto states = terminal_states(descriptor_->inputs, settings_->inputs, bits);
  // The drive was given the other level of this one for an inverted axis (drive_setup).
  if (settings_->scale.invert)
    for (auto& terminal : states)
      if (terminal.function == "pv_direction") terminal.active = !terminal.active;
  return states;
}

std::vector<TerminalState> Terminals::outputs(std::uint32_t bits) const {
  return terminal_states(descriptor_->outputs, settings_->outputs, bits);
}

}  // namespace axisd
