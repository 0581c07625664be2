#include "devices/cia402_eds/simulator_rates.hpp"

#include <algorithm>

namespace axisd::cia402_eds {

std::int64_t MotionObjects::value(std::uint16_t index, std::int64_t without) const {
  return has(index) ? get(index) : without;
}

/// FFFFFFFFh switches either off.
std::optional<std::int64_t> MotionObjects::window(std::uint16_t index) const {
  constexpr std::int64_t off = 0xFFFFFFFF;
  const auto most = value(index, off);
  return most < 0 || most == off ? std::nullopt : std::optional(most);
}

double MotionObjects::speed(std::int64_t velocity) const {
  return static_cast<double>(velocity) * (units_.velocity / units_.position);
}

double MotionObjects::profile_speed() const {
  const auto most = get(0x607F), wanted = get(0x6081);
  return speed(most > 0 ? std::min(wanted, most) : wanted);
}

double MotionObjects::ramp(std::uint16_t index) const {
  constexpr double at_once = 1e12, usual = 10;  // of its own: revolutions per second squared
  while (!has(index)) {
    if (index == 0x6083) return usual / units_.position;
    index = index == 0x6085 ? 0x6084 : 0x6083;
  }
  const auto set = get(index);
  return set > 0 ? static_cast<double>(set) * (units_.acceleration / units_.position) : at_once;
}

simulation::Rates MotionObjects::rates(double cruise) const {
  return {.cruise = cruise, .acceleration = ramp(0x6083), .deceleration = ramp(0x6084)};
}

}  // namespace axisd::cia402_eds
