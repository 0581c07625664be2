// What the objects of the simulated drive count, as turns of its shaft.
#pragma once

#include <cstdint>

#include "devices/simulation/canopen_dictionary.hpp"
#include "devices/simulation/simulated_node.hpp"

namespace axisd::cia402_eds {

/// Of one count; each > 0. Speeds and ramps of the objects become those of the shaft here and nowhere else.
struct ShaftUnits {
  double position;      ///< revolutions: 6064h, 607Ah and their like
  double velocity;      ///< revolutions per second: 606Ch, 6081h, 6099h, 60FFh
  double acceleration;  ///< revolutions per second squared: 6083h, 6084h, 6085h, 609Ah
};

/// By the SI units 60A8h to 60AAh (CiA 402-2; numbers of CiA 303-2), else by the dimension and notation
/// indices 6089h to 608Eh of older drives, else by `settings`. An encoder resolution in 608Fh counts, and a
/// feed in 6092h for positions, unless it is the template 1/1.
ShaftUnits units_of(const simulation::CanopenDictionary& dictionary,
                    const simulation::UnitSettings& settings);

/// A write to this object changes what velocities or ramps count.
bool says_rates(std::uint16_t index);

}  // namespace axisd::cia402_eds
