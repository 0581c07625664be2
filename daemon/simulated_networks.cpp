#include "daemon/simulated_networks.hpp"

#include <fmt/format.h>

#include <utility>

#include "daemon/simulated_lines.hpp"
#include "devices/simulation/can_nodes.hpp"
#include "devices/simulation/control.hpp"
#include "devices/simulation/simulator.hpp"

namespace axisd {

struct SimulatedNetworks::One {
  One(Clock& clock, std::uint32_t bitrate) : network(clock, bitrate), drives(clock, network) {}
  can::Network network;
  simulation::NetworkNodes drives;
};

SimulatedNetworks::SimulatedNetworks() = default;
SimulatedNetworks::~SimulatedNetworks() = default;

Result<std::unique_ptr<SimulatedNetworks>> SimulatedNetworks::open(
    Clock& clock, const config::Configuration& configuration) {
  std::unique_ptr<SimulatedNetworks> networks(new SimulatedNetworks);
  networks->places_.set(configuration);
  for (const auto& bus : configuration.networks) {
    if (!bus.simulated()) continue;
    auto one = std::make_unique<One>(clock, bus.bitrate);
    for (const auto& entry : configuration.axes) {
      if (entry.axis.bus != bus.name) continue;
      auto node = simulation::make_can_node(entry.axis.model, simulated_node(entry));
      if (!node) return fail(node.error());
      one->drives.nodes().add(std::move(*node));
    }
    networks->networks_.emplace(bus.name, std::move(one));
  }
  return networks;
}

void SimulatedNetworks::reconfigure(const config::Configuration& configuration,
                                    const std::vector<ConfigurationChange>& changes) {
  const auto nodes_of = [this](const std::string& bus) -> simulation::CanNodes* {
    const auto found = networks_.find(bus);
    return found == networks_.end() ? nullptr : &found->second->drives.nodes();
  };
  places_.change(
      configuration, changes,
      [&](const SimulatedPlaces::Place& place) {
        if (auto* nodes = nodes_of(place.bus)) nodes->remove(place.node);
      },
      [&](const config::AxisEntry& entry) {
        auto* nodes = nodes_of(entry.axis.bus);
        if (nodes == nullptr) return;
        if (auto node = simulation::make_can_node(entry.axis.model, simulated_node(entry)))
          nodes->add(std::move(*node));  // without, its axis stays offline
      });
}

std::optional<std::string> SimulatedNetworks::control(const std::string& bus,
                                                      std::string_view command) const {
  const auto found = networks_.find(bus);
  if (found == networks_.end()) return std::nullopt;
  return simulation::execute_control(found->second->drives.nodes(), command);
}

can::Network* SimulatedNetworks::find(const std::string& bus) const {
  const auto found = networks_.find(bus);
  return found == networks_.end() ? nullptr : &found->second->network;
}

}  // namespace axisd
