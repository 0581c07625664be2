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
    {{"homing_attained_early", false,
      "\"homing attained\" is shown 20 ms before \"target reached\"; off: both at once"},
     &Behaviour::homing_attained_early},
    {{"homing_attained_late", false,
      "\"homing attained\" is shown 20 ms after \"target reached\"; off: both at once"},
     &Behaviour::homing_attained_late},
    {{"no_mode_changes_nothing", false,
      "6060h = 0 leaves the drive in the mode that it is in; off: it is in none then"},
     &Behaviour::no_mode_changes_nothing},
    {{"mode_change_is_target_reached", false,
      "a change of the mode sets bit 10 until the next start or halt, whatever the motor does; off: it does not"},
     &Behaviour::mode_change_is_target_reached},
    {{"acknowledges_late", false,
      "a set-point is acknowledged 10 ms after it was taken; off: at once"},
     &Behaviour::acknowledges_late},
    {{"acknowledgement_ends_with_motion", false,
      "at the target the acknowledgement falls, whatever control bit 4 is; off: when bit 4 fell"},
     &Behaviour::acknowledgement_ends_with_motion},
    {{"set_points_change_at_once", false,
      "each set-point replaces the one before it at once; off: only with control bit 5, else it waits"},
     &Behaviour::set_points_change_at_once},
    {{"error_code_kept", false,
      "603Fh tells the last error after it was reset, too; off: it is 0 then"},
     &Behaviour::error_code_kept},
    {{"velocity_wavers_at_rest", false,
      "606Ch is off by up to 1 r/min, though 6064h is exact; off: both waver together"},
     &Behaviour::velocity_wavers_at_rest},
    {{"velocity_wavers_by_threshold", false,
      "606Ch is off by up to 606Fh, 30 r/min at most, as with a coarse encoder; off: by up to 1 r/min"},
     &Behaviour::velocity_wavers_by_threshold},
    {{"settles_over_30_counts", false,
      "6064h is some 30 counts behind at the end of a ramp, and settles; off: as its encoder is set"},
     &Behaviour::settles_over_30_counts},
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
