// From the names in a DriveSetup to the codes that a model's descriptor gives them. Pure.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "buses/error.hpp"
#include "devices/descriptor.hpp"

namespace axisd {

/// Function and active level of each terminal of one side.
struct TerminalAssignment {
  std::vector<const TerminalFunctionSpec*> functions;  ///< nullptr: the setup does not name the terminal
  std::uint32_t levels = 0, named = 0;                 ///< bit per terminal
};
/// Errors: misconfigured (no such terminal or function, or one that axisd never assigns).
Result<TerminalAssignment> assign_terminals(const std::vector<TerminalSettings>& terminals,
                                            std::span<const TerminalSpec> known,
                                            std::span<const TerminalFunctionSpec> functions);

/// Bit of the terminal in DriveSample; nothing: the model has none of that name.
std::optional<std::uint32_t> terminal_bit(std::span<const TerminalSpec> known, std::string_view name);
/// These are written before all others (M3). nullptr is none.
bool is_limit_or_stop(const TerminalFunctionSpec* function);
/// An input with this function code can start a motion, or energise the motor.
bool starts_motion(std::span<const TerminalFunctionSpec> functions, std::int64_t code);

/// What the register or object of a setting holds: a choice's index, the number, or 0 and 1. Nothing: it has
/// none.
std::optional<std::int64_t> code_of(const SettingSpec& spec, const SettingValue& value);

}  // namespace axisd
