// The objects of the simulated standard drive: its own, from CiA 301 and CiA 402 alone, or those of a data
// sheet.
#pragma once

#include <cstdint>
#include <span>

#include "buses/canopen/eds.hpp"
#include "devices/simulation/canopen_dictionary.hpp"
#include "devices/simulation/canopen_pdo.hpp"
#include "devices/simulation/simulated_node.hpp"

namespace axisd::cia402_eds {

/// Four PDOs each way; their mapping is changed by the procedure of CiA 301 7.5.2.36 alone.
inline constexpr simulation::PdoSettings pdo_settings{};

void add_rows(simulation::CanopenDictionary& dictionary);

/// What the sheet in `settings` says, which has to outlive the dictionary: types, access, limits, values,
/// what can be mapped. An object without a value has a sensible one.
void add_rows_of_sheet(simulation::CanopenDictionary& dictionary,
                       const simulation::SimulatedNodeSettings& settings);
simulation::PdoSettings pdo_settings_of(const canopen::Eds& sheet);

/// Objects that are never stored by 1010h: what a power-up begins with.
std::span<const std::uint16_t> volatile_objects();

}  // namespace axisd::cia402_eds
