// Points that the manual of the YSS-C leaves open, decided by the simulator.
#pragma once

#include <span>

#include "devices/simulation/simulator.hpp"

namespace axisd::yss_c {

/// One member per switch; what each means stands in the table of simulator_switches.cpp.
struct Behaviour {
  bool halt_edge_cuts_ramp, halt_release_resumes, halt_release_restarts_velocity, velocity_cleared_on_disable,
      mode_change_keeps_setpoint, setpoint_in_motion_ignored, start_of_enabled_edge;
  bool homing_codes_cia, homing_codes_0_to_3, homing_29_ends_backwards, homing_accepts_active_switch,
      homing_goes_on_after_start_bit, homing_pauses, offset_without_move, homed_stays_during_homing;
  bool start_speed_u32, motion_objects_u16, shorter_writes, segmented_uploads, ranges_of_chapter_6;
  bool pdo_parameters_read_only, emergency_cob_is_sync, error_count_grows, mode_not_mappable;
  bool rpdo_sync_refused, rpdo_type_ignored, rpdo_first_counts, rpdo_repeated, rpdo_kept,
      rpdo_applied_by_type;
  bool nmt_reset_keeps_position, position_read_only, position_is_commanded, released_position_frozen,
      position_clear_in_motion, position_clear_late;
  bool bit6_always, bit7_is_warning, homed_only_bit8, homed_only_bit12, bit11_is_limit, bit13_is_homing_error,
      bit13_not_enabled, reached_only_bit10, reached_only_bit15;
  bool fault_needs_reset, alarm_keeps_torque;
  bool quick_stop_releases, disable_operation_cuts, release_keeps_state;
  bool free_stop_releases, abrupt_stop_slips;
  bool terminals_need_operation, stop_terminal_only_edge, velocity_resumes_after_terminal,
      speed_terminal_is_level, configuration_makes_edges, filter_home_and_limits,
      inputs_undefined_at_power_up, states_are_levels;
  bool eeprom_switch_saves_itself, undefined_node_is_1;
};

/// All switches with their defaults, the readings that are likely.
std::span<const simulation::SwitchSpec> switch_specs();
/// Throws std::invalid_argument for an unknown name.
Behaviour behaviour_from(const simulation::Switches& switches);

}  // namespace axisd::yss_c
