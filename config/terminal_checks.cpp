// Terminals, and what cannot work without one.
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <string>

#include "config/axis_checks.hpp"
#include "config/text.hpp"

namespace axisd::config {

namespace {

constexpr std::string_view brake = "brake";

/// The first terminal that can have the function (of the drive's direction) and that the axis does not name;
/// empty if there is none.
/// One with a number, such as X3, before those for a pulse train (PU, DR), to which a controller may be
/// wired.
std::string_view free_terminal(std::span<const TerminalSpec> all, const std::vector<TerminalSettings>& used,
                               std::string_view function) {
  const auto is_free = [&](const TerminalSpec& terminal) {
    const bool fits = terminal.function.empty() || terminal.function == function;
    return fits && std::ranges::find(used, terminal.name, &TerminalSettings::terminal) == used.end();
  };
  const auto has_number = [](const TerminalSpec& terminal) {
    return terminal.name.back() >= '0' && terminal.name.back() <= '9';
  };
  auto free = std::ranges::find_if(
      all, [&](const auto& terminal) { return has_number(terminal) && is_free(terminal); });
  if (free == all.end()) free = std::ranges::find_if(all, is_free);
  return free == all.end() ? std::string_view() : free->name;
}

}  // namespace

void AxisChecks::check_terminals() {
  check_functions(axis_.inputs, "inputs");
  check_functions(axis_.outputs, "outputs");
  check_pv_direction();
  check_brake();
  check_homing_switch();
  check_simulated_switches();
}

const TerminalSettings* AxisChecks::input_with(std::string_view function) const {
  const auto found = std::ranges::find(axis_.inputs, function, &TerminalSettings::function);
  return found == axis_.inputs.end() ? nullptr : &*found;
}

void AxisChecks::check_pv_direction() {
  const auto* enable = input_with("pv_enable");
  if (enable == nullptr || !axis_.scale.invert || !usable("scale.invert")) return;
  // M18: the direction of a multi-speed run is that of the terminal alone (7.4.2), the segment has none.
  need_input(fmt::format("inputs.{}.function", enable->terminal), "pv_direction",
             "'pv_enable' of an inverted axis");
}

void AxisChecks::check_brake() {
  if (!given(brake) || model_ == nullptr || !clean("outputs")) return;
  if (find_function(model_->output_functions, brake) == nullptr) {
    add(brake, fmt::format("'brake' has no effect: model {} has no output function 'brake'", axis_.model),
        "leave it out");
    return;
  }
  if (std::ranges::find(axis_.outputs, brake, &TerminalSettings::function) != axis_.outputs.end()) return;
  const auto free = free_terminal(model_->outputs, axis_.outputs, brake);
  add(brake, "'brake' needs an output with function 'brake'",
      free.empty() ? "" : fmt::format("add outputs: {{ {}: brake }}", free));
}

void AxisChecks::check_homing_switch() {
  if (!axis_.homing || axis_.homing->number || !usable("homing.method")) return;
  const auto method = axis_.homing->method;
  const auto name = homing_methods()[static_cast<std::size_t>(method)];
  const bool by_switch = method == HomingMethod::home_positive || method == HomingMethod::home_negative;
  need_input("homing.method", by_switch ? "home" : name, fmt::format("homing method '{}'", name));
  if (!by_switch || !axis_.scale.invert || !usable("scale.invert") || model_ == nullptr) return;
  // M18: mirrored it would end at the other edge of the switch.
  const auto approach = axis_.model_settings.find("home_approach");
  const bool as_searched =
      approach != axis_.model_settings.end() && approach->second == SettingValue(std::string("as_searched"));
  if (model_->capabilities.home_approach_mirrors || as_searched || !usable("drive.home_approach")) return;
  add("homing.method",
      fmt::format(
          "homing method '{}' cannot be mirrored for an inverted axis: model {} always approaches the "
          "switch in its own forward direction",
          name, axis_.model),
      "home on a limit switch, or turn the motor's direction instead of scale.invert");
}

void AxisChecks::check_functions(const std::vector<TerminalSettings>& terminals, std::string_view section) {
  if (model_ == nullptr) return;
  const auto functions = section == "inputs" ? model_->input_functions : model_->output_functions;
  const auto present = section == "inputs" ? model_->inputs : model_->outputs;
  std::map<std::string_view, std::string_view> owners;
  for (const auto& terminal : terminals) {
    const auto* function = find_function(functions, terminal.function);
    if (std::ranges::find(present, terminal.terminal, &TerminalSpec::name) == present.end())
      add(fmt::format("{}.{}", section, terminal.terminal),
          fmt::format("this drive of model {} has no terminal {}: its data sheet has no object for it",
                      axis_.model, terminal.terminal),
          "leave it out");
    if (function == nullptr || function->code == 0) continue;  // code 0: no function
    const auto key = fmt::format("{}.{}.function", section, terminal.terminal);
    if (!function->unusable.empty())
      add(key, fmt::format("function '{}' is never assigned", terminal.function),
          std::string(function->unusable));
    check_fixed_function(terminal, *function, section);
    const auto [owner, is_first] = owners.try_emplace(terminal.function, terminal.terminal);
    if (is_first) continue;
    add(key, fmt::format("function '{}' is assigned to {} already", terminal.function, owner->second),
        "one terminal per function");
  }
}

void AxisChecks::check_fixed_function(const TerminalSettings& terminal, const TerminalFunctionSpec& function,
                                      std::string_view section) {
  const auto all = section == "inputs" ? model_->inputs : model_->outputs;
  const auto spec = std::ranges::find(all, terminal.terminal, &TerminalSpec::name);
  if (spec == all.end() || spec->function.empty()) return;
  const bool mirrored = axis_.scale.invert && !function.mirror.empty();
  if ((mirrored ? function.mirror : function.name) != spec->function) {
    add(fmt::format("{}.{}.function", section, terminal.terminal),
        fmt::format("terminal {} of model {} is always the drive's {}", terminal.terminal, axis_.model,
                    spec->function),
        axis_.scale.invert ? "on an inverted axis it has the mirrored function" : "give it that function");
  } else if (terminal.active_low) {
    add(fmt::format("{}.{}.active", section, terminal.terminal),
        fmt::format("the level of terminal {} cannot be set on model {}", terminal.terminal, axis_.model),
        "leave 'active' out; set the level with the drive's own tool");
  }
}

void AxisChecks::need_input(std::string_view key, std::string_view function, const std::string& message) {
  if (input_with(function) != nullptr || model_ == nullptr || !clean("inputs")) return;
  // A drive that shows no inputs may have its switches all the same.
  if (model_->inputs.empty()) return;
  const auto* spec = find_function(model_->input_functions, function);
  const bool mirrored = axis_.scale.invert && spec != nullptr && !spec->mirror.empty();
  const auto free = free_terminal(model_->inputs, axis_.inputs, mirrored ? spec->mirror : function);
  add(key, fmt::format("{} needs an input with function '{}'", message, function),
      free.empty() ? "no input is free for it" : fmt::format("add inputs: {{ {}: {} }}", free, function));
}

void AxisChecks::check_simulated_switches() {
  const auto& simulation = entry_.simulation;
  if (given("simulate.home_switch")) need_input("simulate.home_switch", "home", "'home_switch'");
  if (given("simulate.positive_limit"))
    need_input("simulate.positive_limit", "positive_limit", "'positive_limit'");
  if (given("simulate.negative_limit"))
    need_input("simulate.negative_limit", "negative_limit", "'negative_limit'");
  for (const std::string_view unit : {"velocity_unit", "acceleration_unit"}) {
    const auto key = fmt::format("simulate.{}", unit);
    if (!given(key) || model_ == nullptr) continue;
    if (model_->specialise != nullptr || axis_.own_descriptor != nullptr) continue;  // by a file, good or bad
    add(key, fmt::format("'{}' has no effect: no data sheet makes model {}", unit, axis_.model),
        "leave it out");
  }
  if (given("simulate.home_width") && !given("simulate.home_switch")) {
    add("simulate.home_width", "'home_width' has no effect without home_switch",
        "add home_switch or leave it out");
  }
  if (!clean("simulate")) return;
  const double lowest = simulation.negative_limit.value_or(-std::numeric_limits<double>::infinity());
  const double highest = simulation.positive_limit.value_or(std::numeric_limits<double>::infinity());
  if (lowest >= highest) {
    add("simulate.positive_limit", "the simulated limits are reversed",
        "make positive_limit larger than negative_limit");
  } else if (simulation.start_position <= lowest || simulation.start_position >= highest) {
    add("simulate.start_position", "the load would start on a limit switch",
        "start between the simulated limits");
  }
}

}  // namespace axisd::config
