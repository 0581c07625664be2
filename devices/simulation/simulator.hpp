#pragma once

#include <memory>
#include <span>
#include <string_view>

#include "buses/error.hpp"
#include "devices/descriptor.hpp"
#include "devices/simulation/simulated_node.hpp"

namespace axisd::simulation {

/// One open point of a manual that a simulator decides (see Switches).
struct SwitchSpec {
  std::string_view name;
  bool default_value = false;
  std::string_view meaning;  ///< of the position on
};

/// What a model folder exports for its simulator.
struct Simulator {
  std::string_view model;  ///< as in the YAML: "ykd2405pr"
  /// One of the two, by the model's bus.
  std::unique_ptr<SimulatedRtuNode> (*make)(SimulatedNodeSettings settings) = nullptr;
  std::unique_ptr<SimulatedCanNode> (*make_can)(SimulatedNodeSettings settings) = nullptr;
  std::span<const SwitchSpec> switches{};
  std::span<const TerminalSpec> inputs{};
  std::uint32_t last_register = 0xFFFF;  ///< highest address that `eeprom` may name
  std::uint8_t maximum_node = 127;
  std::uint8_t maximum_dip_address = 31;  ///< of the address switches
  std::span<const int> dip_bauds{};       ///< bit/s that the baud rate switches can be set to
  bool takes_sheet = false;               ///< it can be made by a data sheet
};

/// All simulated models, generated from the folders.
std::span<const Simulator* const> simulators();
/// nullptr if there is none of that name.
const Simulator* find_simulator(std::string_view model);

/// Makes a node. Errors: unknown model, switch, register or terminal of a wire; an address or baud rate that
/// the model cannot be set to.
Result<std::unique_ptr<SimulatedRtuNode>> make_node(std::string_view model, SimulatedNodeSettings settings);
/// Likewise on a CAN network.
Result<std::unique_ptr<SimulatedCanNode>> make_can_node(std::string_view model,
                                                        SimulatedNodeSettings settings);
/// The same for a simulator at hand.
Result<std::unique_ptr<SimulatedRtuNode>> make_node(const Simulator& simulator,
                                                    SimulatedNodeSettings settings);

}  // namespace axisd::simulation
