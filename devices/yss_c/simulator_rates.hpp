// What the objects of the simulated YSS-C say of its motor (2006h, 200Eh, 6081h).
#pragma once

#include "devices/simulation/canopen_dictionary.hpp"
#include "devices/simulation/profile.hpp"

namespace axisd::yss_c {

[[nodiscard]] int pulses_per_revolution(const simulation::CanopenDictionary& dictionary);
/// Of a motion with the start speed that is set now.
[[nodiscard]] simulation::Rates rates_of(const simulation::CanopenDictionary& dictionary, double rpm,
                                         double acceleration_ms, double deceleration_ms);

}  // namespace axisd::yss_c
