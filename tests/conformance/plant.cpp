#include "tests/conformance/plant.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string_view>

namespace axisd::conformance {

namespace {

using namespace std::chrono_literals;

/// Where a manual contradicts itself, the other reading is one key of the configuration (drive:).
struct Reading {
  std::string_view switch_name;  ///< not in its default position
  std::string_view key, value;
};
constexpr Reading other_readings[] = {
    {"input_functions_at_0043", "terminal_registers", "wiring"},
    {"homing_mode_1_final_approach_same", "home_approach", "as_searched"},
    {"homing_29_ends_backwards", "home_approach", "as_searched"},
    {"states_are_levels", "terminal_states", "level"},
    {"bit13_not_enabled", "status_bit_13", "homing_error"},
};

/// A drive that shows no inputs has its switches all the same.
std::vector<Wanted> inputs_of(const Manual& manual, const Recipe& recipe) {
  std::vector<Wanted> inputs;
  if (manual.is_a_make() && manual.list("inputs").empty()) return inputs;
  if (recipe.home_switch) inputs.push_back({"home"});
  if (recipe.limit_switches) {
    inputs.push_back({"positive_limit"});
    inputs.push_back({"negative_limit"});
  }
  inputs.insert(inputs.end(), recipe.inputs.begin(), recipe.inputs.end());
  return inputs;
}

/// A terminal for each function: the one that has it for good, else one after the other.
std::vector<std::string> chosen(const Manual& manual, const std::vector<std::string>& names,
                                const std::vector<Wanted>& wanted, bool invert) {
  if (wanted.size() > names.size())
    throw std::invalid_argument("the model has too few terminals for this recipe");
  std::vector<std::string> terminals;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const auto only = manual.terminal_of(function_of_drive(wanted[i].function, invert));
    terminals.push_back(only.empty() ? names[i] : only);
  }
  return terminals;
}

std::string terminal_lines(const std::vector<std::string>& terminals, const std::vector<Wanted>& wanted) {
  std::string text;
  for (std::size_t i = 0; i < wanted.size(); ++i)
    text += fmt::format("      {}: {{ function: {}, active: {} }}\n", terminals[i], wanted[i].function,
                        wanted[i].active_low ? "low" : "high");
  return text;
}

std::string mechanics_of(const Manual& manual, const Variant& variant, const Recipe& recipe) {
  if (!recipe.mechanics) return {};
  const auto pulses = [&](double mm) {
    return std::lround(mm * pulses_per_mm(manual)) * (variant.invert ? -1 : 1);
  };
  std::string text;
  if (recipe.home_switch)
    text += fmt::format(",home={}:{}", pulses(variant.invert ? recipe.home_at.second : recipe.home_at.first),
                        pulses(variant.invert ? recipe.home_at.first : recipe.home_at.second));
  if (recipe.limit_switches)
    text += fmt::format(",positive_limit={},negative_limit={}",
                        pulses(variant.invert ? negative_limit_at : positive_limit_at),
                        pulses(variant.invert ? positive_limit_at : negative_limit_at));
  return text;
}

/// A drive that does not show its switches leaves them by itself.
std::string homing_keys_of(const Manual& manual, const Recipe& recipe) {
  constexpr std::string_view backoff = "backoff: 5 mm, ";
  auto keys = recipe.homing_keys;
  if (!manual.list("inputs").empty()) return keys;
  if (const auto at = keys.find(backoff); at != std::string::npos) keys.erase(at, backoff.size());
  return keys;
}

}  // namespace

std::string data_sheet_keys(const Manual& manual) {
  if (!manual.has("data_sheet")) return {};
  const auto& unit = manual.text("velocity_unit");
  return "eds: " + manual.data_sheet() + (unit.empty() ? "" : ", velocity_unit: " + unit);
}

std::string data_sheet_options(const Manual& manual) {
  if (!manual.is_a_make()) return {};
  return fmt::format("eds={},counts={}{}", manual.data_sheet(), manual.counts(), manual.text("simulated"));
}

std::string function_of_drive(const std::string& function, bool invert) {
  if (invert && function == "positive_limit") return "negative_limit";
  return invert && function == "negative_limit" ? "positive_limit" : function;
}

bool can_home_on_the_home_switch(const Manual& manual, const Variant& variant) {
  const bool as_searched = std::ranges::any_of(other_readings, [&](const Reading& one) {
    return one.key == "home_approach" && variant.switches.contains(std::string(one.switch_name));
  });
  return !variant.invert || as_searched || manual.text("homing_mode_1_final_approach") == "backward";
}

std::string any_homing_method(const Manual& manual, const Variant& variant) {
  if (manual.list("homing_modes").empty()) return {};
  return can_home_on_the_home_switch(manual, variant) ? "home_negative" : "negative_limit";
}

std::string Variant::name() const {
  std::string text = invert ? "inverted" : "plain";
  for (const auto& [name, on] : switches) text += fmt::format(" {}={}", name, on ? "on" : "off");
  return text + fmt::format(" noise={}", noise);
}

std::map<std::string, std::string> terminals_of(const Manual& manual, const Variant& variant,
                                                const Recipe& recipe) {
  std::map<std::string, std::string> terminals;
  const auto inputs = inputs_of(manual, recipe);
  const auto names = chosen(manual, manual.list("inputs"), inputs, variant.invert);
  for (std::size_t i = 0; i < inputs.size(); ++i) terminals[inputs[i].function] = names[i];
  return terminals;
}

std::string bus_lines(const Manual& manual, int baud, Duration sync_period) {
  const auto rate = baud == 0 ? manual.highest_baud() : baud;
  const auto settings = manual.bus() == "canopen"
                            ? fmt::format("interface: sim, bitrate: {}, sync_period: {} ms", rate,
                                          std::chrono::round<std::chrono::milliseconds>(sync_period).count())
                            : fmt::format("port: sim, baud: {}", rate);
  return fmt::format("machine: conformance\nbuses:\n  line: {{ {}: {{ {} }} }}\naxes:\n", manual.bus(),
                     settings);
}

Plant make_plant(const Manual& manual, const Variant& variant, const Recipe& recipe) {
  // Flipped switches are many, and each SYNC takes the processor's time.
  auto yaml = bus_lines(manual, recipe.baud, variant.switches.empty() ? 10ms : 40ms);
  yaml += fmt::format(
      "  axis:\n    bus: line\n    node: {}\n    model: {}\n    unit: mm\n"
      "    scale: {{ microstep: {} pulses/rev, travel: {:g} mm/rev, invert: {} }}\n"
      "    limits: {{ {}velocity: 100 mm/s }}\n",
      recipe.node, manual.model(), manual.counts(), mm_per_revolution, variant.invert,
      recipe.limits ? "position: [0, 400], " : "");
  if (recipe.limits) yaml += "    jog_travel: 10 mm\n";
  const auto method = recipe.homing == "any" ? any_homing_method(manual, variant) : recipe.homing;
  if (!method.empty())
    yaml += fmt::format("    homing: {{ method: {}, {} }}\n", method, homing_keys_of(manual, recipe));
  const auto inputs = inputs_of(manual, recipe);
  if (!inputs.empty())
    yaml += "    inputs:\n" +
            terminal_lines(chosen(manual, manual.list("inputs"), inputs, variant.invert), inputs);
  if (!recipe.outputs.empty())
    yaml += "    outputs:\n" +
            terminal_lines(chosen(manual, manual.list("outputs"), recipe.outputs, false), recipe.outputs);
  std::string settings = recipe.settings;
  if (const auto sheet = data_sheet_keys(manual); !sheet.empty())
    settings += (settings.empty() ? "" : ", ") + sheet;
  for (const auto& one : other_readings)
    if (variant.switches.contains(std::string(one.switch_name)))
      settings += fmt::format("{}{}: {}", settings.empty() ? "" : ", ", one.key, one.value);
  if (!settings.empty()) yaml += fmt::format("    drive: {{ {} }}\n", settings);
  yaml += recipe.keys;

  auto drive =
      fmt::format("node={},model={}{}", recipe.node, manual.model(), mechanics_of(manual, variant, recipe));
  for (const auto& [name, on] : variant.switches)
    drive += fmt::format(",switch.{}={}", name, on ? "on" : "off");
  if (manual.says_yes("closed_loop"))
    drive += fmt::format(",encoder.noise={},encoder.following_ms=8,encoder.quantised=on", variant.noise);
  if (const auto sheet = data_sheet_options(manual); !sheet.empty()) drive += "," + sheet;
  if (!recipe.drive.empty()) drive += "," + recipe.drive;
  return {.yaml = std::move(yaml), .drives = {std::move(drive)}};
}

}  // namespace axisd::conformance
