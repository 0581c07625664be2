// Motions that are asked for while their axis is being enabled.
#pragma once

#include "devices/axis/activity.hpp"
#include "devices/axis/command.hpp"

namespace axisd {

/// A motion with an end waits for the command that enables its axis, and starts when that is done; its time
/// runs all the while (M31).
inline bool waits_for_power(const ActivityPtr& executed, const Action& action) {
  if (!executed || executed->command->value().kind != CommandKind::enable) return false;
  const auto kind = kind_of(action);
  return kind == CommandKind::home || kind == CommandKind::move_absolute ||
         kind == CommandKind::move_relative;
}

}  // namespace axisd
