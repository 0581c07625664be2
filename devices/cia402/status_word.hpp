// The state machine of CiA 402 (YSS-C manual 6.2.1). Pure.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace axisd::cia402 {

enum class State : std::uint8_t {
  not_ready_to_switch_on,
  switch_on_disabled,
  ready_to_switch_on,
  switched_on,
  operation_enabled,
  quick_stop_active,
  fault_reaction_active,
  fault,
  undefined,  ///< bits 0 to 3 that no state has
};
std::string_view to_string(State state);

/// The state that a status word (6041h) shows. Bit 6 decides only where bits 0 to 3 are 0: 6.2.2 of the
/// YSS-C's manual prints it as set in every state, 6.2.1 and CiA 402 in Switch On Disabled alone.
State state_of(std::uint16_t status_word);
/// By the state: current flows, or may.
bool is_energised(State state);

/// What bits 0 to 3 and 7 of the control word (6040h) ask for.
enum class ControlCommand : std::uint8_t {
  shutdown,
  switch_on,
  enable_operation,
  disable_operation,
  disable_voltage,
  quick_stop,
  fault_reset,  ///< by the rising edge of bit 7
};
/// The control word of a command, all other bits 0.
std::uint16_t control_word(ControlCommand command);

/// One arrow of the state machine, numbered as in CiA 402.
struct Transition {
  int number = 0;
  State from = State::undefined;  ///< undefined: power-up (0), or any state (13)
  State to = State::undefined;
  std::optional<ControlCommand> command{};  ///< nothing: the drive does it by itself
};
/// All of them, in order; those that several commands cause once for each.
std::span<const Transition> transitions();

/// The next step towards Operation Enabled, towards a released power stage. Nothing: there already, or none
/// that a master may cause (a fault is reset on purpose only; Quick Stop Active is left by releasing).
std::optional<Transition> next_to_enabled(State state);
std::optional<Transition> next_to_released(State state);

}  // namespace axisd::cia402
