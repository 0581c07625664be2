#include "daemon/simulated_lines.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "devices/simulation/control.hpp"
#include "devices/simulation/drive_option.hpp"
#include "devices/simulation/simulator.hpp"
#include "devices/units/scale.hpp"

namespace axisd {

namespace {
/// What is measured wavers and lags as on a real drive, so that who tries axisd without hardware sees it.
constexpr simulation::EncoderSettings usual_encoder{
    .noise = 1, .following = std::chrono::milliseconds(3), .quantised = true};

/// What nobody says of the drive that is simulated is as `drive:` says of the one that is meant.
void set_unit(const config::AxisEntry& entry, std::string_view key, const std::string& simulated,
              simulation::UnitSettings& units) {
  const auto meant = entry.axis.model_settings.find(std::string(key));
  const auto* named =
      meant == entry.axis.model_settings.end() ? nullptr : std::get_if<std::string>(&meant->second);
  const auto& name = simulated.empty() && named != nullptr ? *named : simulated;
  if (!name.empty()) simulation::set_unit_option(units, key, name);  // the schema has no other names
}
}  // namespace

simulation::SimulatedNodeSettings simulated_node(const config::AxisEntry& entry) {
  const Scale scale(entry.axis.scale);
  const auto& simulate = entry.simulation;
  const auto pulses = [&](double units) { return scale.to_pulses(units - simulate.start_position); };
  simulation::SimulatedNodeSettings node{.address = entry.axis.node, .encoder = usual_encoder};
  node.sheet = simulate.sheet;
  node.units.counts_per_revolution = static_cast<double>(entry.axis.scale.pulses_per_revolution);
  set_unit(entry, "velocity_unit", simulate.velocity_unit, node.units);
  set_unit(entry, "acceleration_unit", simulate.acceleration_unit, node.units);
  auto& mechanics = node.mechanics;
  if (simulate.home_switch) {
    const auto edges =
        std::minmax({pulses(*simulate.home_switch), pulses(*simulate.home_switch + simulate.home_width)});
    mechanics.home_switch_from = edges.first;
    mechanics.home_switch_to = edges.second;
    if (entry.axis.scale.modulo)
      mechanics.turn = *entry.axis.scale.modulo * std::abs(scale.pulses_per_unit());
  }
  if (simulate.positive_limit) mechanics.positive_limit_from = pulses(*simulate.positive_limit);
  if (simulate.negative_limit) mechanics.negative_limit_from = pulses(*simulate.negative_limit);
  if (entry.axis.scale.invert) std::swap(mechanics.positive_limit_from, mechanics.negative_limit_from);
  const auto* simulator = simulation::find_simulator(entry.axis.model);
  constexpr std::string_view power_up = "enabled_at_power_up";
  if (simulator != nullptr && std::ranges::find(simulator->switches, power_up,
                                                &simulation::SwitchSpec::name) != simulator->switches.end())
    node.switches.emplace(power_up, simulate.enabled_at_power_up);
  return node;
}

Result<std::unique_ptr<SimulatedLines>> SimulatedLines::open(const config::Configuration& configuration) {
  auto lines = std::make_unique<SimulatedLines>();
  lines->places_.set(configuration);
  for (const auto& bus : configuration.lines) {
    if (!bus.simulated()) continue;
    std::vector<std::unique_ptr<simulation::SimulatedRtuNode>> nodes;
    for (const auto& entry : configuration.axes) {
      if (entry.axis.bus != bus.name) continue;
      const auto* simulator = simulation::find_simulator(entry.axis.model);
      if (simulator == nullptr)
        return fail(Reason::not_supported, fmt::format("there is no simulated {}", entry.axis.model));
      nodes.push_back(simulator->make(simulated_node(entry)));
    }
    auto line = simulation::PtyLine::open(
        {.serial = {.baud = bus.baud, .format = bus.format}, .link = {}, .observer = {}}, std::move(nodes));
    if (!line) return fail(line.error());
    lines->lines_.emplace(bus.name, std::move(*line));
  }
  return lines;
}

void SimulatedLines::reconfigure(const config::Configuration& configuration,
                                 const std::vector<ConfigurationChange>& changes) {
  const auto with = [this](const std::string& bus, const auto& use) {
    if (const auto line = lines_.find(bus); line != lines_.end()) line->second->with_network(use);
  };
  places_.change(
      configuration, changes,
      [&](const SimulatedPlaces::Place& place) {
        with(place.bus, [&](simulation::RtuNetwork& network) { network.remove(place.node); });
      },
      [&](const config::AxisEntry& entry) {
        const auto* simulator = simulation::find_simulator(entry.axis.model);
        if (simulator == nullptr) return;  // its axis stays offline
        with(entry.axis.bus,
             [&](simulation::RtuNetwork& network) { network.add(simulator->make(simulated_node(entry))); });
      });
}

std::optional<std::string> SimulatedLines::control(const std::string& bus, std::string_view command) const {
  const auto found = lines_.find(bus);
  if (found == lines_.end()) return std::nullopt;
  return simulation::execute_control(*found->second, command);
}

std::string SimulatedLines::path(const std::string& bus) const {
  const auto found = lines_.find(bus);
  return found == lines_.end() ? std::string() : found->second->path();
}

}  // namespace axisd
