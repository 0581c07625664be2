// Points that CiA 402 leaves to the maker, decided by the simulator.
#pragma once

#include <span>

#include "devices/simulation/simulator.hpp"

namespace axisd::cia402_eds {

/// One member per switch; what each means stands in the table of simulator_switches.cpp.
struct Behaviour {
  bool halt_release_drops, halt_release_keeps_velocity_at_0, set_point_in_halt_refused;
  bool homing_attained_forgotten, homing_goes_on_without_start_bit, homing_pauses;
  bool homing_attained_early, homing_attained_late;
  bool no_mode_changes_nothing, mode_change_is_target_reached;
  bool acknowledges_late, acknowledgement_ends_with_motion, set_points_change_at_once;
  bool error_code_kept, velocity_wavers_at_rest, velocity_wavers_by_threshold, settles_over_30_counts;
  bool velocity_resumes_after_limit, limit_stops_on_ramp, segmented_uploads;
};

/// All switches with their defaults: what most drives do.
std::span<const simulation::SwitchSpec> switch_specs();
/// Throws std::invalid_argument for an unknown name.
Behaviour behaviour_from(const simulation::Switches& switches);

}  // namespace axisd::cia402_eds
