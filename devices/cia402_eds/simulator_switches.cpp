#include "devices/cia402_eds/simulator_switches.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <stdexcept>
#include <string>

namespace axisd::cia402_eds {

namespace {

struct Entry {
  simulation::SwitchSpec spec;
  bool Behaviour::* member;
};

// clang-format off
constexpr Entry entries[] = {
    {{"halt_release_drops", false,
      "a set-point that a halt interrupted is dropped; off: it goes on when halt is released"},
     &Behaviour::halt_release_drops},
    {{"halt_release_keeps_velocity_at_0", false,
      "after a halt velocity mode waits for a new 60FFh; off: it runs again as soon as halt is released"},
     &Behaviour::halt_release_keeps_velocity_at_0},
    {{"set_point_in_halt_refused", false,
      "a set-point given during halt is not acknowledged; off: it is, and begins when halt is released"},
     &Behaviour::set_point_in_halt_refused},
    {{"homing_attained_forgotten", false,
      "leaving homing mode clears \"homing attained\"; off: it is shown again on the return"},
     &Behaviour::homing_attained_forgotten},
    {{"homing_goes_on_without_start_bit", false,
      "clearing control bit 4 does not end homing, halt does; off: it ends it"},
     &Behaviour::homing_goes_on_without_start_bit},
    {{"limit_stops_on_ramp", false,
      "at a limit switch the drive brakes with 6084h; off: with 6085h"},
     &Behaviour::limit_stops_on_ramp},
    {{"segmented_uploads", false,
      "every upload is segmented; off: what fits into one frame is expedited"},
     &Behaviour::segmented_uploads},
};
// clang-format on

constexpr auto specs = [] {
  std::array<simulation::SwitchSpec, std::size(entries)> all{};
  for (std::size_t i = 0; i < all.size(); ++i) all.at(i) = entries[i].spec;
  return all;
}();

}  // namespace

std::span<const simulation::SwitchSpec> switch_specs() { return specs; }

Behaviour behaviour_from(const simulation::Switches& switches) {
  Behaviour behaviour{};
  for (const auto& entry : entries) behaviour.*entry.member = entry.spec.default_value;
  for (const auto& [name, on] : switches) {
    const auto* found =
        std::ranges::find_if(entries, [&](const Entry& entry) { return entry.spec.name == name; });
    if (found == std::end(entries)) throw std::invalid_argument("cia402 has no switch \"" + name + "\"");
    behaviour.*found->member = on;
  }
  return behaviour;
}

}  // namespace axisd::cia402_eds
