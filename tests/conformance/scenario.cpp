#include "tests/conformance/scenario.hpp"

#include <fmt/format.h>
#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <exception>
#include <map>
#include <random>

#include "devices/simulation/simulator.hpp"

namespace axisd::conformance {

std::span<const Subject> subjects() {
  static const Subject all[] = {
      {"power", true, power_scenarios()},      {"motion", true, motion_scenarios()},
      {"stop", true, stop_scenarios()},        {"homing", true, homing_scenarios()},
      {"limits", true, limit_scenarios()},     {"alarms", false, alarm_scenarios()},
      {"reboot", false, reboot_scenarios()},   {"terminals", true, terminal_scenarios()},
      {"segments", true, segment_scenarios()}, {"parameters", false, parameter_scenarios()},
      {"serial", false, serial_scenarios()},   {"eeprom", false, eeprom_scenarios()},
      {"bus", false, bus_scenarios()},
  };
  return all;
}

namespace {

/// Two switches of a simulator of which one at most is off or on: a drive that does neither or both cannot
/// be.
struct Either {
  std::string_view first, second;
  bool on;  ///< the position that they cannot both have
};
constexpr Either exclusive[] = {
    {"homing_codes_cia", "homing_codes_0_to_3", false},
    {"homed_only_bit8", "homed_only_bit12", true},
    {"reached_only_bit10", "reached_only_bit15", true},
};

/// Of two exclusive switches the one that stands at its default gives way to the one that was flipped.
void make_possible(std::map<std::string, bool>& flipped, std::span<const simulation::SwitchSpec> specs) {
  const auto position = [&](std::string_view name) {
    const auto found = flipped.find(std::string(name));
    return found != flipped.end()
               ? found->second
               : std::ranges::find(specs, name, &simulation::SwitchSpec::name)->default_value;
  };
  for (const auto& [first, second, on] : exclusive) {
    const auto known = std::ranges::find(specs, first, &simulation::SwitchSpec::name) != specs.end();
    if (known && position(first) == on && position(second) == on)
      flipped[std::string(flipped.contains(std::string(first)) ? second : first)] = !on;
  }
}

}  // namespace

std::vector<Variant> variants_of(const std::string& model, const Subject& subject, bool sampled, int noise) {
  constexpr std::size_t pairs = 12, part = 5;
  std::vector<Variant> all{{.invert = false, .noise = noise}, {.invert = true, .noise = noise}};
  if (!subject.varied) return all;
  const auto switches = simulation::find_simulator(model)->switches;
  const auto flipped = [](const simulation::SwitchSpec& one) {
    return std::pair<const std::string, bool>(one.name, !one.default_value);
  };
  const auto same = std::ranges::find(subjects(), subject.name, &Subject::name);
  const auto salt = static_cast<std::size_t>(same - subjects().begin()) + model.size();
  for (std::size_t i = 0; i < switches.size(); ++i)
    if (!sampled || (i + salt) % part == 0)
      all.push_back(
          {.invert = (i / part + salt) % 2 != 0, .switches = {flipped(switches[i])}, .noise = noise});
  std::mt19937 random(static_cast<std::uint32_t>(salt));
  for (std::size_t i = 0; i < (sampled ? pairs / part : pairs); ++i) {
    const auto& first = switches[random() % switches.size()];
    const auto& second = switches[random() % switches.size()];
    all.push_back(
        {.invert = random() % 2 == 0, .switches = {flipped(first), flipped(second)}, .noise = noise});
  }
  for (auto& variant : all) make_possible(variant.switches, switches);
  return all;
}

namespace {

/// Scenarios go by their names: each has one of its own, and what a model lacks is one of them.
void check_names(const std::vector<Manual>& manuals, std::vector<std::string>& failures) {
  std::vector<std::string_view> names;
  for (const auto& subject : subjects())
    for (const auto& scenario : subject.scenarios) {
      if (std::ranges::find(names, scenario.name) != names.end())
        failures.push_back(fmt::format("two scenarios have the name {}", scenario.name));
      names.push_back(scenario.name);
    }
  for (const auto& manual : manuals)
    if (manual.has("lacks"))
      for (const auto& name : manual.list("lacks"))
        if (std::ranges::find(names, name) == names.end())
          failures.push_back(fmt::format("{} lacks {}, which is no scenario", manual.model(), name));
}

}  // namespace

std::string capability_matrix(std::vector<std::string>& failures) {
  std::vector<Manual> manuals;
  for (const auto& model : models()) manuals.emplace_back(model);
  check_names(manuals, failures);
  std::string text = "| |", rule = "| --- |";
  for (const auto& manual : manuals) {
    text += fmt::format(" {} |", manual.model());
    rule += " --- |";
  }
  text += "\n" + rule + "\n";
  for (const auto& subject : subjects())
    for (const auto& scenario : subject.scenarios) {
      text += fmt::format("| {} |", scenario.ability);
      for (const auto& manual : manuals) {
        const auto finding = run_scenario(scenario, manual, {});
        text += fmt::format(" {} |", finding.failures.empty() ? finding.shown : "FAILED");
        failures.insert(failures.end(), finding.failures.begin(), finding.failures.end());
      }
      text += "\n";
    }
  return text;
}

Finding run_scenario(const Scenario& scenario, const Manual& manual, const Variant& variant,
                     const TargetMaker& make_target, bool brief) {
  Finding finding;
  auto* const run = manual.lacks(scenario.name) ? scenario.refused : scenario.run;
  ::testing::TestPartResultArray parts;
  std::string broken;
  {
    const ::testing::ScopedFakeTestPartResultReporter reporter(
        ::testing::ScopedFakeTestPartResultReporter::INTERCEPT_ONLY_CURRENT_THREAD, &parts);
    try {
      if (run == nullptr) throw Broken("lacked by its abilities, but nothing shows that it is refused");
      finding.shown = run({.manual = manual, .variant = variant, .make_target = make_target, .brief = brief});
    } catch (const std::exception& error) {
      broken = error.what();
    }
  }
  const auto where = fmt::format("{} / {} / {}", manual.name(), scenario.name, variant.name());
  for (int i = 0; i < parts.size(); ++i) {
    const auto& part = parts.GetTestPartResult(i);
    if (part.failed())
      finding.failures.push_back(fmt::format("{}: {}:{}: {}", where, part.file_name() ? part.file_name() : "",
                                             part.line_number(), part.message()));
  }
  if (!broken.empty()) finding.failures.push_back(fmt::format("{}: {}", where, broken));
  if (!finding.failures.empty()) finding.shown.clear();
  return finding;
}

}  // namespace axisd::conformance
