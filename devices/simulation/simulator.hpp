#pragma once

#include <memory>
#include <span>
#include <string_view>

#include "devices/simulation/simulated_node.hpp"

namespace axisd::simulation {

/// What a model folder exports for its simulator.
struct Simulator {
  std::string_view model;  ///< as in the YAML: "ykd2405pr"
  std::unique_ptr<SimulatedRtuNode> (*make)(SimulatedNodeSettings settings) = nullptr;
};

/// All simulated models, generated from the folders.
std::span<const Simulator* const> simulators();
/// nullptr if there is none of that name.
const Simulator* find_simulator(std::string_view model);

}  // namespace axisd::simulation
