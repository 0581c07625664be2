#include "devices/cia402_eds/simulator_switches.hpp"

#include "devices/simulation/switch_table.hpp"

namespace axisd::cia402_eds {

namespace {

using Entry = simulation::SwitchEntry<Behaviour>;

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
    {{"homing_pauses", false,
      "the motor rests for 100 ms between the phases of homing; off: it turns at once"},
     &Behaviour::homing_pauses},
    {{"velocity_resumes_after_limit", false,
      "60FFh is followed again as soon as a limit switch opens; off: only after it was written"},
     &Behaviour::velocity_resumes_after_limit},
    {{"limit_stops_on_ramp", false,
      "at a limit switch the drive brakes with 6084h; off: with 6085h"},
     &Behaviour::limit_stops_on_ramp},
    {{"segmented_uploads", false,
      "every upload is segmented; off: what fits into one frame is expedited"},
     &Behaviour::segmented_uploads},
};
// clang-format on

constexpr auto specs = simulation::specs_of(entries);

}  // namespace

std::span<const simulation::SwitchSpec> switch_specs() { return specs; }

Behaviour behaviour_from(const simulation::Switches& switches) {
  return simulation::behaviour_of("cia402", entries, switches);
}

}  // namespace axisd::cia402_eds
