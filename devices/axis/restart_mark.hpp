// What is kept of an axis whose drive was restarted, and which nobody has enabled since (M1).
#pragma once

#include <string>

#include "devices/drive.hpp"
#include "devices/persistence.hpp"

namespace axisd {

/// In place of the canary in the record of an axis: its drive was restarted. No drive's mark is this: an
/// older daemon finds a restart, too.
inline const ContinuityMark& restart_mark() {
  static const ContinuityMark mark(6, 0xFFFF);
  return mark;
}

/// A later run of the daemon finds no position for the axis; and that its drive was `restarted`, if it was.
inline void forget_position(Persistence& kept, const std::string& axis, bool restarted) {
  restarted ? kept.save_offset(axis, {.canary = restart_mark()}, {}) : kept.forget_offset(axis, {});
}

}  // namespace axisd
