// The objects of the simulated YSS-C (chapter 7), not from the driver's table.
#pragma once

#include "devices/simulation/canopen_dictionary.hpp"
#include "devices/simulation/canopen_pdo.hpp"
#include "devices/yss_c/simulator_switches.hpp"

namespace axisd::yss_c {

/// All rows, as `behaviour` reads the manual; the PDOs as in `pdos`.
void add_rows(simulation::CanopenDictionary& dictionary, const Behaviour& behaviour,
              const simulation::PdoSettings& pdos);

}  // namespace axisd::yss_c
