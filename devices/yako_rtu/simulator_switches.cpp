#include "devices/yako_rtu/simulator_switches.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace axisd::yako_rtu {

namespace {

/// One reading; where the models' manuals differ, each has an entry of its own for the same member.
struct Entry {
  simulation::SwitchSpec spec;
  bool Behaviour::* member;
  bool (*applies)(const SimulatedModel& model) = nullptr;  ///< nothing: to every model
};

bool is_closed_loop(const SimulatedModel& model) { return model.closed_loop; }
bool ends_forwards(const SimulatedModel& model) { return model.homing_mode_1_ends_forwards; }
bool ends_as_it_searches(const SimulatedModel& model) { return !model.homing_mode_1_ends_forwards; }
bool has_other_model_code(const SimulatedModel& model) { return model.other_model_code != 0; }
bool has_other_inputs(const SimulatedModel& model) { return model.other_first_input_function != 0; }
bool has_few_segments(const SimulatedModel& model) { return model.segments < 16; }
bool may_be_deaf(const SimulatedModel& model) { return model.undefined_custom_address == 0; }
bool keeps_overtravel_in_ram(const SimulatedModel& model) { return !model.overtravel_saved; }

// clang-format off
constexpr Entry entries[] = {
    {{"starts_late", false,
      "the motor begins 80 ms after a start was acknowledged, and a stop before that does nothing; off: at once"},
     &Behaviour::starts_late},
    {{"start_in_motion", false,
      "a start while moving takes over from the present speed; off: acknowledged and ignored"},
     &Behaviour::start_in_motion},
    {{"start_in_motion_refused", false,
      "a start while moving is refused with exception 06"},
     &Behaviour::start_in_motion_refused},
    {{"start_in_motion_from_target", false,
      "a relative start that takes over counts from the target before; off: from where it is"},
     &Behaviour::start_in_motion_from_target},
    {{"one_frame_start", true,
      "0x0027 starts the motion also as one of several registers of a write; off: there it is ignored"},
     &Behaviour::one_frame_start},
    {{"one_frame_start_refused", false,
      "0x0027 as one of several registers of a write is refused with exception 06"},
     &Behaviour::one_frame_start_refused},
    {{"start_refused_when_disabled", false,
      "a start in alarm or released is refused with exception 06; off: acknowledged and ignored"},
     &Behaviour::start_refused_when_disabled},
    {{"reserved_start_refused", false,
      "0x0027 = 0, 3, 4 is refused with exception 07; off: acknowledged, does nothing"},
     &Behaviour::reserved_start_refused},
    {{"reserved_start_moves", false,
      "0x0027 = 3 starts a position move, as its bit 0 says"},
     &Behaviour::reserved_start_moves},
    {{"unsigned_speed", false,
      "0x000C is the magnitude; off: signed"},
     &Behaviour::unsigned_speed},
    {{"model_code_0302", false,
      "0x0000 reads 0x0302; off: 0x0301"},
     &Behaviour::other_model_code, &has_other_model_code},
    {{"in_position_at_power_up", false,
      "status bit 0 is 1 after power-up"},
     &Behaviour::in_position_at_power_up},
    {{"in_position_after_stop", false,
      "status bit 0 is 1 whenever a motion ended; off: only after a completed position move"},
     &Behaviour::in_position_after_stop},
    {{"enabled_at_power_up", true,
      "the motor is energised after power-up (the examples of 6.2.5 never enable it); off: released"},
     &Behaviour::enabled_at_power_up},
    {{"eeprom_switch_saves_itself", false,
      "0x0016 = 1 is itself saved; off: it is back at 0 after a power cycle"},
     &Behaviour::eeprom_switch_saves_itself},
    {{"pv_speeds_always_saved", false,
      "PV speeds are saved even if 0x0016 = 1, as 7.4 says"},
     &Behaviour::pv_speeds_always_saved},
    {{"position_clear_in_motion", false,
      "0x002C clears the counter while moving; off: acknowledged and ignored"},
     &Behaviour::position_clear_in_motion},
    {{"position_clear_late", false,
      "the counter shows 0 only 20 ms after 0x002C was acknowledged; off: at once"},
     &Behaviour::position_clear_late},
    {{"homing_pauses", false,
      "the motor rests for 100 ms between the phases of homing; off: it turns at once"},
     &Behaviour::homing_pauses},
    {{"abrupt_stop_slips", false,
      "without pulses at speed a motor in open loop turns on for 10 ms, which the counter does not see"},
     &Behaviour::abrupt_stop_slips},
    {{"free_stop_releases", false,
      "the free stop at a limit (0x0017 = 0) releases the motor; off: it only stops the pulses"},
     &Behaviour::free_stop_releases},
    {{"alarm_releases", false,
      "an alarm releases the motor; off: it stays locked, as chapter 8 says"},
     &Behaviour::alarm_releases},
    {{"stop_ignored_in_homing", false,
      "0x0028 does nothing while homing (the manual defines it for position and speed mode)"},
     &Behaviour::stop_ignored_in_homing},
    {{"stop_ignored_in_pt_pv", false,
      "0x0028 does nothing in PT and PV mode"},
     &Behaviour::stop_ignored_in_pt_pv},
    {{"stop_uses_new_deceleration", false,
      "a stop uses 0x0022 as it is now; off: as it was before the start (7.6.2)"},
     &Behaviour::stop_uses_new_deceleration},
    {{"stop_terminal_only_edge", false,
      "a held stop terminal does not block starts; off: its level blocks them"},
     &Behaviour::stop_terminal_only_edge},
    {{"partial_block_write", false,
      "a write of several registers keeps those before the bad one; off: none is written"},
     &Behaviour::partial_block_write},
    {{"bad_register_skipped", false,
      "a write of several registers keeps all but the bad one, those behind it, too"},
     &Behaviour::bad_register_skipped},
    {{"limit_block_writes", false,
      "writes of more than 16 registers are refused with exception 05"},
     &Behaviour::limit_block_writes},
    {{"crc_error_answered", false,
      "a wrong CRC is answered with exception 01, as the example of 6.2.4; off: silence, as its text"},
     &Behaviour::crc_error_answered},
    {{"function_error_code_1", false,
      "an unknown function is answered with 01, as the text of 6.2.4; off: 02, as its example"},
     &Behaviour::function_error_code_1},
    {{"pv_latched", false,
      "a PV run goes on when its enable input falls, until a stop; off: it ends"},
     &Behaviour::pv_latched},
    {{"speed_terminal_is_level", false,
      "the speed mode input stops the motor when it falls; off: it only starts it"},
     &Behaviour::speed_terminal_is_level},
    {{"configuration_makes_edges", false,
      "assigning or inverting an input that is active acts like an edge; off: it does not"},
     &Behaviour::configuration_makes_edges},
    {{"filter_home_and_limits", false,
      "home and limit inputs must last as long as others before they act; off: they act at once"},
     &Behaviour::filter_home_and_limits},
    {{"homed_stays_during_homing", false,
      "the homing done bit of the last time stays while homing; off: cleared at the start"},
     &Behaviour::homed_stays_during_homing},
    {{"homing_accepts_active_switch", false,
      "homing takes a switch that is active at the start; off: it waits for a rising edge (7.5)"},
     &Behaviour::homing_accepts_active_switch},
    {{"homing_same_edge", false,
      "after a limit, homing passes the home switch and comes back to the same edge; off: it mirrors 7.5"},
     &Behaviour::homing_same_edge},
    {{"homing_never_gives_up", false,
      "homing goes on reversing between both limits; off: it ends undone at the second"},
     &Behaviour::homing_never_gives_up},
    {{"zero_before_compensation", false,
      "the counter is 0 at the switch, before the compensation; off: after it"},
     &Behaviour::zero_before_compensation},
    {{"back_off_at_homing_speed", false,
      "leaving the switch runs at 0x0032; off: at 0x0033 (\"return speed after home is found\")"},
     &Behaviour::back_off_at_homing_speed},
    {{"homing_mode_1_final_approach_same", false,
      "homing mode 1 ends in the direction of its search, as on YKD2405PR; off: forwards (7.5)"},
     &Behaviour::homing_mode_1_other_approach, &ends_forwards},
    {{"homing_mode_1_final_approach_forwards", false,
      "homing mode 1 ends forwards, as on SSD2608PR and ESS42-R; off: in the direction of its search"},
     &Behaviour::homing_mode_1_other_approach, &ends_as_it_searches},
    {{"homing_mode_1_either_edge", false,
      "mode 1 turns where it stopped and ends at the first edge of the switch; off: it runs on until it has "
      "passed the switch"},
     &Behaviour::homing_mode_1_either_edge, &ends_forwards},
    {{"input_functions_at_0043", false,
      "the functions of X0..X4 are at 0x0043..0x0047 as 4.3 writes them, 0x0041 and 0x0042 are holes; off: at "
      "0x0041..0x0045 (6.1)"},
     &Behaviour::other_input_functions, &has_other_inputs},
    {{"inputs_undefined_at_power_up", false,
      "input functions are 0 after each power-up, as 4.3 says; off: as saved (6.1)"},
     &Behaviour::inputs_undefined_at_power_up},
    {{"more_than_7_segments", false,
      "PIN3 and PIN4 select segments above 7; off: 7 at most (note of 7.3.2)"},
     &Behaviour::all_segments, &has_few_segments},
    {{"commands_readable", false,
      "0x0028..0x002C and 0x0030 can be read, as 6.1 prints, and are 0; off: exception 06, as 0x0027"},
     &Behaviour::commands_readable},
    {{"overtravel_stop_saved", false,
      "0x0017 is saved like its neighbours; off: printed without /S, only 0x002B = 2 saves it"},
     &Behaviour::overtravel_stop_saved, &keeps_overtravel_in_ram},
    {{"undefined_address_is_1", false,
      "with the address switches off and 0x0013 undefined the address is 1; off: it answers nobody"},
     &Behaviour::undefined_address_is_1, &may_be_deaf},
    {{"mode_stays", false,
      "0x0003 keeps the mode of the last start when homing, PT or PV has ended; off: it is 0 at rest"},
     &Behaviour::mode_stays},
    {{"position_words_torn", false,
      "where 0x000A has just changed, one reading still shows it as it was beside the new 0x000B; off: both "
      "words are of one moment"},
     &Behaviour::position_words_torn},
    {{"position_is_commanded", false,
      "0x000A counts the pulses sent to the motor; off: what the encoder saw"},
     &Behaviour::position_is_commanded, &is_closed_loop},
    {{"released_position_frozen", false,
      "0x000A does not follow a shaft that is turned while released; off: it does"},
     &Behaviour::released_position_frozen, &is_closed_loop},
    {{"loop_mode_from_power_up", false,
      "0x0012 counts from the next power-up; off: at once"},
     &Behaviour::loop_mode_from_power_up, &is_closed_loop},
};
// clang-format on

bool applies(const Entry& entry, const SimulatedModel& model) {
  return entry.applies == nullptr || entry.applies(model);
}

}  // namespace

std::vector<simulation::SwitchSpec> switch_specs(const SimulatedModel& model) {
  std::vector<simulation::SwitchSpec> specs;
  for (const auto& entry : entries)
    if (applies(entry, model)) specs.push_back(entry.spec);
  return specs;
}

Behaviour behaviour_from(const SimulatedModel& model, const simulation::Switches& switches) {
  Behaviour behaviour{};
  for (const auto& entry : entries)
    if (applies(entry, model)) behaviour.*entry.member = entry.spec.default_value;
  for (const auto& [name, on] : switches) {
    const auto* found = std::ranges::find_if(
        entries, [&](const Entry& entry) { return entry.spec.name == name && applies(entry, model); });
    if (found == std::end(entries))
      throw std::invalid_argument(std::string(model.name) + " has no switch \"" + name + "\"");
    behaviour.*found->member = on;
  }
  return behaviour;
}

}  // namespace axisd::yako_rtu
