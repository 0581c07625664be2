#include "devices/yss_c/simulator_rates.hpp"

#include <algorithm>
#include <array>

namespace axisd::yss_c {

namespace {

// 7, codes of 2006h.
constexpr std::array<int, 16> microsteps{400,  800,  1600, 3200, 6400, 12800, 25600, 51200,
                                         1000, 2000, 4000, 5000, 8000, 10000, 20000, 40000};

}  // namespace

int pulses_per_revolution(const simulation::CanopenDictionary& dictionary) {
  return microsteps.at(static_cast<std::size_t>(dictionary.get(0x2006)) & 15U);
}

simulation::Rates rates_of(const simulation::CanopenDictionary& dictionary, double rpm,
                           double acceleration_ms, double deceleration_ms) {
  const double pulses = pulses_per_revolution(dictionary);
  const double fastest = std::min(3000.0, 12e6 / pulses);  // 6081h: 200 kHz of pulses
  return simulation::rates_from(static_cast<double>(dictionary.get(0x200E)), std::min(rpm, fastest),
                                acceleration_ms, deceleration_ms, pulses);
}

}  // namespace axisd::yss_c
