// What differs between the simulated models of the family, each line from the manual of its model.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "devices/descriptor.hpp"
#include "devices/simulation/simulator.hpp"

namespace axisd::yako_rtu {

/// What a code of an output's function shows (6.1 from 0x004C); the codes are the model's.
enum class Output : std::uint8_t { none, alarm, brake, moving, homed, in_position, pt_mode };

struct SimulatedModel {
  std::string_view name;                           ///< as in the YAML
  std::span<const ParameterSpec> (*parameters)();  ///< table of 6.1
  std::uint16_t last;                              ///< last register; beyond it: exception 04
  std::uint16_t other_model_code = 0;              ///< a second one that the manual prints for 0x0000
  std::array<int, 16> pulses_per_revolution;       ///< by code of 0x0011
  std::span<const TerminalSpec> inputs;            ///< in the order of the bits of 0x0008 and 0x0040
  std::uint16_t first_input_function;              ///< register of the first input
  std::uint16_t other_first_input_function = 0;    ///< where another chapter has it
  std::uint16_t first_filter;                      ///< filter of X0 and X1, the next pairs follow
  std::size_t unfiltered_inputs = 0;               ///< high-speed inputs before X0
  int outputs;                                     ///< Y0..
  std::span<const Output> output_functions;        ///< by code
  std::span<const int> alarms;                     ///< chapter 8
  bool homing_mode_1_ends_forwards = false;        ///< 7.5: direction of its last, slow approach
  bool closed_loop = false;                        ///< has an encoder, and 0x0012 says whether it counts
  bool pulse_input = false;                        ///< 0x0018 gives the motor to a pulse input
  bool overtravel_saved = true;                    ///< 0x0017 is printed RW/S
  int segments = 16;                               ///< that terminals can select (7.3.2)
  std::array<int, 4> custom_bauds;                 ///< bit/s by code of 0x0014
  std::span<const int> dip_bauds;                  ///< what its switches give apart from "custom" (4.4)
  std::uint8_t maximum_dip_address;                ///< address switches; all off: 0x0013
  std::uint8_t first_custom_address, last_custom_address;  ///< values of 0x0013 with a meaning
  std::uint8_t undefined_custom_address = 0;               ///< address with any other value; 0: deaf
};

/// The switches that `model` has, with their defaults for it.
std::vector<simulation::SwitchSpec> switch_specs(const SimulatedModel& model);

std::unique_ptr<simulation::SimulatedRtuNode> make_simulated_drive(
    const SimulatedModel& model, simulation::SimulatedNodeSettings settings);

/// What a model folder exports.
template <const SimulatedModel& model>
std::span<const simulation::Simulator> simulators_of() {
  static const auto switches = switch_specs(model);
  static const simulation::Simulator all[] = {
      {.model = model.name,
       .make =
           [](simulation::SimulatedNodeSettings settings) {
             return make_simulated_drive(model, std::move(settings));
           },
       .switches = switches,
       .inputs = model.inputs,
       .last_register = model.last,
       .maximum_node = std::max(model.maximum_dip_address, model.last_custom_address),
       .maximum_dip_address = model.maximum_dip_address,
       .dip_bauds = model.dip_bauds}};
  return all;
}

}  // namespace axisd::yako_rtu
