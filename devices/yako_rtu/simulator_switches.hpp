// The points that the manual leaves open, each a named switch (motion-rules.md, facts): tests pass either
// way.
#pragma once

#include "devices/simulation/simulator.hpp"
#include "devices/yako_rtu/simulator_model.hpp"

namespace axisd::yako_rtu {

struct Behaviour {
  bool starts_late;
  bool start_in_motion, start_in_motion_refused, start_in_motion_from_target;
  bool one_frame_start, one_frame_start_refused;
  bool start_refused_when_disabled, reserved_start_refused, reserved_start_moves;
  bool unsigned_speed, other_model_code;
  bool in_position_at_power_up, in_position_after_stop;
  bool enabled_at_power_up, eeprom_switch_saves_itself, pv_speeds_always_saved;
  bool position_clear_in_motion, position_clear_late, abrupt_stop_slips, free_stop_releases, alarm_releases;
  bool stop_ignored_in_homing, stop_ignored_in_pt_pv, stop_uses_new_deceleration, stop_terminal_only_edge;
  bool partial_block_write, bad_register_skipped;
  bool limit_block_writes, crc_error_answered, function_error_code_1;
  bool pv_latched, speed_terminal_is_level, configuration_makes_edges, filter_home_and_limits;
  bool homed_stays_during_homing, homing_accepts_active_switch, homing_same_edge, homing_never_gives_up,
      homing_pauses, zero_before_compensation, back_off_at_homing_speed, homing_mode_1_other_approach,
      homing_mode_1_either_edge;
  bool other_input_functions, inputs_undefined_at_power_up, all_segments;
  bool commands_readable, overtravel_stop_saved, undefined_address_is_1;
  bool mode_stays, position_words_torn;
  bool position_is_commanded, released_position_frozen, loop_mode_from_power_up;
};

/// The defaults of `model` with `switches` over them. Throws std::invalid_argument for a name that is not in
/// switch_specs(model).
Behaviour behaviour_from(const SimulatedModel& model, const simulation::Switches& switches);

}  // namespace axisd::yako_rtu
