#include "devices/cia402/status_word.hpp"

#include <algorithm>
#include <array>

namespace axisd::cia402 {

namespace {

using enum State;

/// 6.2.1, second table: bits that count, and how they stand.
struct Pattern {
  std::uint16_t mask, bits;
  State state;
};
constexpr auto patterns = std::to_array<Pattern>({
    {0x004F, 0x0000, not_ready_to_switch_on},
    {0x004F, 0x0040, switch_on_disabled},
    {0x000F, 0x0001, ready_to_switch_on},
    {0x000F, 0x0003, switched_on},
    {0x002F, 0x0027, operation_enabled},
    {0x002F, 0x0007, quick_stop_active},
    {0x000F, 0x000F, fault_reaction_active},
    {0x000F, 0x0008, fault},
});

// 6.2.1, first table, with CiA 402's transitions that a drive makes by itself (0, 1, 13, 14).
constexpr auto arrows = std::to_array<Transition>({
    {0, undefined, not_ready_to_switch_on, {}},
    {1, not_ready_to_switch_on, switch_on_disabled, {}},
    {2, switch_on_disabled, ready_to_switch_on, ControlCommand::shutdown},
    {3, ready_to_switch_on, switched_on, ControlCommand::switch_on},
    {4, switched_on, operation_enabled, ControlCommand::enable_operation},
    {5, operation_enabled, switched_on, ControlCommand::disable_operation},
    {6, switched_on, ready_to_switch_on, ControlCommand::shutdown},
    {7, ready_to_switch_on, switch_on_disabled, ControlCommand::disable_voltage},
    {7, ready_to_switch_on, switch_on_disabled, ControlCommand::quick_stop},
    {8, operation_enabled, ready_to_switch_on, ControlCommand::shutdown},
    {9, operation_enabled, switch_on_disabled, ControlCommand::disable_voltage},
    {10, switched_on, switch_on_disabled, ControlCommand::disable_voltage},
    {10, switched_on, switch_on_disabled, ControlCommand::quick_stop},
    {11, operation_enabled, quick_stop_active, ControlCommand::quick_stop},
    {12, quick_stop_active, switch_on_disabled, ControlCommand::disable_voltage},
    {13, undefined, fault_reaction_active, {}},
    {14, fault_reaction_active, fault, {}},
    {15, fault, switch_on_disabled, ControlCommand::fault_reset},
    {16, quick_stop_active, operation_enabled, ControlCommand::enable_operation},
});

std::optional<Transition> by_number(int number) {
  return *std::ranges::find(arrows, number, &Transition::number);
}

}  // namespace

std::string_view to_string(State state) {
  static constexpr auto names = std::to_array<std::string_view>(
      {"Not Ready To Switch On", "Switch On Disabled", "Ready To Switch On", "Switched On",
       "Operation Enabled", "Quick Stop Active", "Fault Reaction Active", "Fault", "an undefined state"});
  return names.at(static_cast<std::size_t>(state));
}

State state_of(std::uint16_t status_word) {
  for (const auto& pattern : patterns)
    if ((status_word & pattern.mask) == pattern.bits) return pattern.state;
  return undefined;
}

bool is_energised(State state) {
  return state == switched_on || state == operation_enabled || state == quick_stop_active ||
         state == fault_reaction_active;
}

std::uint16_t control_word(ControlCommand command) {
  switch (command) {
    case ControlCommand::shutdown:
      return 0x0006;
    case ControlCommand::switch_on:
    case ControlCommand::disable_operation:
      return 0x0007;
    case ControlCommand::enable_operation:
      return 0x000F;
    case ControlCommand::quick_stop:
      return 0x0002;
    case ControlCommand::fault_reset:
      return 0x0080;
    case ControlCommand::disable_voltage:
      break;
  }
  return 0x0000;
}

std::span<const Transition> transitions() { return arrows; }

std::optional<Transition> next_to_enabled(State state) {
  switch (state) {
    case switch_on_disabled:
      return by_number(2);
    case ready_to_switch_on:
      return by_number(3);
    case switched_on:
      return by_number(4);
    default:
      return std::nullopt;
  }
}

std::optional<Transition> next_to_released(State state) {
  switch (state) {
    case switched_on:
      return by_number(6);
    case operation_enabled:
      return by_number(8);
    case quick_stop_active:
      return by_number(12);
    default:
      return std::nullopt;
  }
}

}  // namespace axisd::cia402
