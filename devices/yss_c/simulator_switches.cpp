#include "devices/yss_c/simulator_switches.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>

namespace axisd::yss_c {

namespace {

struct Entry {
  simulation::SwitchSpec spec;
  bool Behaviour::* member;
};

// clang-format off
constexpr Entry entries[] = {
    {{"halt_edge_cuts_ramp", true,
      "bit 8 that rises with 605Dh = 1 ends a ramp at once that another stop began; off: the "
      "ramp goes on"},
     &Behaviour::halt_edge_cuts_ramp},
    {{"halt_release_resumes", true,
      "releasing halt goes on with the interrupted move or homing (CiA 402); off: it is dropped "
      "(6.2.4: \"ends the present position\")"},
     &Behaviour::halt_release_resumes},
    {{"halt_release_restarts_velocity", true,
      "releasing halt in velocity mode runs at 60FFh again (6.2.5: \"executes the motion\"); "
      "off: only after 60FFh was written"},
     &Behaviour::halt_release_restarts_velocity},
    {{"velocity_cleared_on_disable", false,
      "60FFh becomes 0 when Operation Enabled is left; off: it stays, and 0Fh starts the motor "
      "again"},
     &Behaviour::velocity_cleared_on_disable},
    {{"mode_change_keeps_setpoint", false,
      "a suspended set-point outlives a change of 6060h; off: dropped (CiA 402)"},
     &Behaviour::mode_change_keeps_setpoint},
    {{"setpoint_in_motion_ignored", false,
      "a set-point while moving is not taken (bit 12 stays 0); off: taken over or buffered by "
      "bit 5"},
     &Behaviour::setpoint_in_motion_ignored},
    {{"start_of_enabled_edge", true,
      "bit 4 that rises in the very write that enables operation starts; off: only an edge "
      "within Operation Enabled"},
     &Behaviour::start_of_enabled_edge},
    {{"homing_codes_cia", true,
      "6098h takes 17, 18, 24, 29 (6.2.6)"},
     &Behaviour::homing_codes_cia},
    {{"homing_codes_0_to_3", false,
      "6098h takes 0, 1, 2, 3 (chapter 7)"},
     &Behaviour::homing_codes_0_to_3},
    {{"homing_29_ends_backwards", false,
      "homing 29 ends in the direction of its search; off: forwards (6.2.6)"},
     &Behaviour::homing_29_ends_backwards},
    {{"homing_accepts_active_switch", false,
      "homing takes a switch that is active at the start; off: it waits for a rising edge"},
     &Behaviour::homing_accepts_active_switch},
    {{"homing_goes_on_after_start_bit", false,
      "homing goes on when bit 4 falls; off: that interrupts it (6.2.6)"},
     &Behaviour::homing_goes_on_after_start_bit},
    {{"offset_without_move", false,
      "607Ch shifts the origin without a motion (CiA 402); off: the motor moves by it and is 0 "
      "there"},
     &Behaviour::offset_without_move},
    {{"homed_stays_during_homing", false,
      "the homing done bit of the last time stays while homing; off: cleared at the start"},
     &Behaviour::homed_stays_during_homing},
    {{"start_speed_u32", false,
      "200Eh has 4 bytes (table of 6.2.4); off: 2 (chapter 7)"},
     &Behaviour::start_speed_u32},
    {{"motion_objects_u16", false,
      "6081h, 6083h, 6084h have 2 bytes (example of 6.2.4); off: 4 (chapter 7)"},
     &Behaviour::motion_objects_u16},
    {{"shorter_writes", false,
      "a download of fewer bytes than the object has is taken (example of 6.2.4); off: aborted "
      "with 06070013h"},
     &Behaviour::shorter_writes},
    {{"segmented_uploads", false,
      "every upload is segmented; off: expedited, as nothing is longer than 4 bytes"},
     &Behaviour::segmented_uploads},
    {{"ranges_of_chapter_6", false,
      "6099h and 609Ah from 0, 607Ch to +-0x7FFFFFFF (6.2.6); off: as in chapter 7"},
     &Behaviour::ranges_of_chapter_6},
    {{"pdo_parameters_read_only", false,
      "COB-IDs and numbers of entries of PDOs are read-only as printed, the numbers follow the "
      "entries; off: as CiA 301"},
     &Behaviour::pdo_parameters_read_only},
    {{"emergency_cob_is_sync", false,
      "1014h is 0x80 as printed, so that an EMCY is a SYNC; off: 0x80 + node (CiA 301)"},
     &Behaviour::emergency_cob_is_sync},
    {{"error_count_grows", false,
      "1003h:00 is the number of errors (CiA 301); off: always 4, as printed"},
     &Behaviour::error_count_grows},
    {{"mode_not_mappable", false,
      "6060h cannot be mapped (6.2.3); off: it can (chapter 7)"},
     &Behaviour::mode_not_mappable},
    {{"rpdo_sync_refused", false,
      "RPDOs take the event-driven types only; off: also those that wait for a SYNC"},
     &Behaviour::rpdo_sync_refused},
    {{"rpdo_type_ignored", false,
      "an RPDO acts as soon as it comes, whatever its type; off: one of type 0 to 240 at the next SYNC (CiA 301)"},
     &Behaviour::rpdo_type_ignored},
    {{"rpdo_first_counts", false,
      "of several RPDOs before one SYNC the first counts; off: the last (CiA 301)"},
     &Behaviour::rpdo_first_counts},
    {{"rpdo_repeated", false,
      "what came by an RPDO for SYNC is applied again with each later SYNC; off: once"},
     &Behaviour::rpdo_repeated},
    {{"rpdo_kept", false,
      "an RPDO that waits for a SYNC outlives leaving Operational; off: it is dropped"},
     &Behaviour::rpdo_kept},
    {{"rpdo_applied_by_type", false,
      "an RPDO that waits for a SYNC acts when its type becomes event-driven; off: it still waits"},
     &Behaviour::rpdo_applied_by_type},
    {{"nmt_reset_keeps_position", false,
      "NMT reset of the node keeps 6064h; off: it is 0 as after power-up"},
     &Behaviour::nmt_reset_keeps_position},
    {{"position_read_only", false,
      "6064h is read-only (CiA 402); off: a write sets the position (chapter 7)"},
     &Behaviour::position_read_only},
    {{"position_is_commanded", false,
      "6064h counts the pulses sent to the motor; off: what the encoder saw"},
     &Behaviour::position_is_commanded},
    {{"released_position_frozen", false,
      "6064h does not follow a shaft that is turned while released; off: it does"},
     &Behaviour::released_position_frozen},
    {{"position_clear_in_motion", false,
      "2012h clears the position while moving; off: acknowledged and ignored"},
     &Behaviour::position_clear_in_motion},
    {{"position_clear_late", false,
      "6064h shows 0 only 20 ms after 2012h was acknowledged; off: at once"},
     &Behaviour::position_clear_late},
    {{"homing_pauses", false,
      "the motor rests for 100 ms between the phases of homing; off: it turns at once"},
     &Behaviour::homing_pauses},
    {{"velocity_resumes_after_terminal", false,
      "60FFh is followed again as soon as a limit or stop terminal opens; off: only after it was written"},
     &Behaviour::velocity_resumes_after_terminal},
    {{"bit6_always", false,
      "status bit 6 is 1 in every state (6.2.2); off: in Switch On Disabled only (6.2.1)"},
     &Behaviour::bit6_always},
    {{"bit7_is_warning", false,
      "status bit 7 is a warning (CiA 402) and stays 0 in alarm; off: 1 in alarm (6.2.2)"},
     &Behaviour::bit7_is_warning},
    {{"homed_only_bit8", false,
      "homing done is bit 8 only; off: bit 12 in homing mode too"},
     &Behaviour::homed_only_bit8},
    {{"homed_only_bit12", false,
      "homing done is bit 12 in homing mode only (appendix); off: bit 8 too"},
     &Behaviour::homed_only_bit12},
    {{"bit11_is_limit", false,
      "status bit 11: a limit switch is active (CiA 402); off: control bit 4 (6.2.2)"},
     &Behaviour::bit11_is_limit},
    {{"bit13_is_homing_error", false,
      "status bit 13 in homing mode: homing failed (appendix); off: motor energised (6.2.2)"},
     &Behaviour::bit13_is_homing_error},
    {{"bit13_not_enabled", false,
      "status bit 13 is set in homing mode alone, when homing failed (CiA 402); off: outside of it, motor "
      "energised (6.2.2)"},
     &Behaviour::bit13_not_enabled},
    {{"reached_only_bit10", false,
      "a completed move shows in bit 10 only; off: in bit 15 too"},
     &Behaviour::reached_only_bit10},
    {{"reached_only_bit15", false,
      "a completed move shows in bit 15 only; off: in bit 10 too"},
     &Behaviour::reached_only_bit15},
    {{"fault_needs_reset", false,
      "alarms 2 and 3 stay until a fault reset after their cause (CiA 402); off: they recover "
      "by themselves (chapter 8)"},
     &Behaviour::fault_needs_reset},
    {{"alarm_keeps_torque", false,
      "in alarm the motor stays energised; off: released (CiA 402, Fault)"},
     &Behaviour::alarm_keeps_torque},
    {{"quick_stop_releases", false,
      "control bit 2 = 0 in operation releases the motor at once; off: it brakes and holds, "
      "Quick Stop Active"},
     &Behaviour::quick_stop_releases},
    {{"disable_operation_cuts", false,
      "07h in motion stops the pulses at once; off: it brakes"},
     &Behaviour::disable_operation_cuts},
    {{"release_keeps_state", false,
      "200Fh = 0 releases without a change of state; off: Switch On Disabled follows"},
     &Behaviour::release_keeps_state},
    {{"free_stop_releases", false,
      "the free stop at a limit (200Ah = 0) releases the motor; off: it only stops the pulses"},
     &Behaviour::free_stop_releases},
    {{"abrupt_stop_slips", false,
      "without pulses at speed a motor in open loop turns on for 10 ms, which the counter does "
      "not see"},
     &Behaviour::abrupt_stop_slips},
    {{"terminals_need_operation", false,
      "terminals start motion in Operation Enabled only; off: whenever the motor is energised"},
     &Behaviour::terminals_need_operation},
    {{"stop_terminal_only_edge", false,
      "a held stop terminal does not block starts; off: its level blocks them"},
     &Behaviour::stop_terminal_only_edge},
    {{"speed_terminal_is_level", false,
      "the speed mode input stops the motor when it falls; off: it only starts it"},
     &Behaviour::speed_terminal_is_level},
    {{"configuration_makes_edges", false,
      "assigning or inverting an input that is active acts like an edge; off: it does not"},
     &Behaviour::configuration_makes_edges},
    {{"filter_home_and_limits", false,
      "home and limit inputs must last as long as others before they act; off: they act at once"},
     &Behaviour::filter_home_and_limits},
    {{"inputs_undefined_at_power_up", false,
      "input functions are 0 after each power-up, as 4.3 says; off: as saved (chapter 7)"},
     &Behaviour::inputs_undefined_at_power_up},
    {{"states_are_levels", false,
      "2003h and 2004h show levels (\"输入电平状态\"), whatever 2030h:01 and 2030h:0C make of them; off: "
      "what is active"},
     &Behaviour::states_are_levels},
    {{"eeprom_switch_saves_itself", false,
      "200Ch = 1 is itself saved; off: it is back at 0 after a power cycle"},
     &Behaviour::eeprom_switch_saves_itself},
    {{"undefined_node_is_1", false,
      "with the switches off and 2008h below 16 the node-ID is 1; off: it takes no part"},
     &Behaviour::undefined_node_is_1},
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
    if (found == std::end(entries)) throw std::invalid_argument("yss-c has no switch \"" + name + "\"");
    behaviour.*found->member = on;
  }
  return behaviour;
}

}  // namespace axisd::yss_c
