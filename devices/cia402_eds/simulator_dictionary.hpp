// The objects of the simulated standard drive, from CiA 301 and CiA 402 alone.
#pragma once

#include <cstdint>
#include <span>

#include "devices/simulation/canopen_dictionary.hpp"
#include "devices/simulation/canopen_pdo.hpp"

namespace axisd::cia402_eds {

/// Four PDOs each way; their mapping is changed by the procedure of CiA 301 7.5.2.36 alone.
inline constexpr simulation::PdoSettings pdo_settings{};

void add_rows(simulation::CanopenDictionary& dictionary);

/// Objects that are never stored by 1010h: what a power-up begins with.
std::span<const std::uint16_t> volatile_objects();

}  // namespace axisd::cia402_eds
