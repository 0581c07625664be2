// What the configuration says of a drive itself.
#pragma once

#include <cstdint>
#include <string>
#include <variant>

namespace axisd {

/// Homing methods, in axis direction. Further ones may follow with further families.
enum class HomingMethod : std::uint8_t { home_positive, home_negative, positive_limit, negative_limit };

/// One terminal as the YAML assigns it: `X1: { function: positive_limit, active: low }`.
struct TerminalSettings {
  std::string terminal;  ///< "X0", "PU", "Y1"
  std::string function;  ///< by the descriptor's name; axis direction
  bool active_low = false;
};

/// What is saved in the drive's EEPROM: `persist: true`, `false`, or a list of these.
struct PersistSettings {
  bool terminals = false, segments = false, homing = false;
  bool drive = false;  ///< microstep and everything under `drive:`
  [[nodiscard]] bool any() const { return terminals || segments || homing || drive; }
  static constexpr PersistSettings all() { return {true, true, true, true}; }
  bool operator==(const PersistSettings&) const = default;
};

/// Value of a model-specific setting, after the descriptor's schema was applied.
using SettingValue = std::variant<bool, std::int64_t, double, std::string>;

}  // namespace axisd
