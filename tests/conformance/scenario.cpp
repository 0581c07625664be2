#include "tests/conformance/scenario.hpp"

#include <fmt/format.h>
#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include <exception>
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

std::vector<Variant> variants_of(const std::string& model, bool varied, bool sampled) {
  constexpr int pairs = 12;
  const auto switches = simulation::find_simulator(model)->switches;
  std::vector<Variant> all{{.invert = false}, {.invert = true}};
  if (!varied) return all;
  const auto flipped = [](const simulation::SwitchSpec& one) {
    return std::pair<const std::string, bool>(one.name, !one.default_value);
  };
  std::mt19937 random(20240731);
  std::size_t index = 0;
  for (const auto& one : switches) {
    // In a sampled run each switch is seen every fourth time only, and which ones differs between the models.
    if (sampled && (index++ + model.size()) % 4 != 0) continue;
    all.push_back({.invert = random() % 2 == 0, .switches = {flipped(one)}});
    if (!sampled) all.push_back({.invert = !all.back().invert, .switches = {flipped(one)}});
  }
  for (int i = 0; i < (sampled ? pairs / 4 : pairs); ++i) {
    const auto& first = switches[random() % switches.size()];
    const auto& second = switches[random() % switches.size()];
    all.push_back({.invert = random() % 2 == 0, .switches = {flipped(first), flipped(second)}});
  }
  return all;
}

Finding run_scenario(const Scenario& scenario, const Manual& manual, const Variant& variant) {
  Finding finding;
  ::testing::TestPartResultArray parts;
  std::string broken;
  {
    const ::testing::ScopedFakeTestPartResultReporter reporter(
        ::testing::ScopedFakeTestPartResultReporter::INTERCEPT_ONLY_CURRENT_THREAD, &parts);
    try {
      finding.shown = scenario.run({.manual = manual, .variant = variant});
    } catch (const std::exception& error) {
      broken = error.what();
    }
  }
  const auto where = fmt::format("{} / {} / {}", manual.model(), scenario.name, variant.name());
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
