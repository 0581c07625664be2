// What is kept of an axis's position over restarts of the daemon (M20).
#pragma once

#include <cstdint>

#include "buses/task.hpp"
#include "devices/axis/axis_context.hpp"
#include "devices/axis/axis_life.hpp"
#include "devices/axis/power_machine.hpp"
#include "devices/axis/shaft.hpp"
#include "devices/persistence.hpp"

namespace axisd {

/// Writes the record of the position; it is read when the drive is connected. Thread: core.
class SavedPosition {
 public:
  SavedPosition(const AxisContext& context, const Shaft& shaft, const PowerMachine& power,
                const AxisLife& life)
      : context_(context), shaft_(shaft), power_(power), life_(life) {}
  SavedPosition(const SavedPosition&) = delete;

  /// What would be saved of the position with that offset.
  [[nodiscard]] OffsetRecord offset_record(std::int64_t offset, PositionTrust trust) const;
  /// Saves it, where it is trusted.
  void remember_position();
  /// The record says again what the axis goes by.
  void correct_saved_position();
  /// A restart finds no position, and that the drive was restarted, if it was. At the end it keeps the
  /// canary.
  void void_saved_position();
  /// The drive's canary is one that this run has proven to be there, or writes.
  void own_canary() { owns_canary_ = true; }
  /// Saves the canary, by which a later run finds a restart of the drive, also without a position (M1). Only
  /// at the end: until then each start changes it.
  void keep_canary(PositionTrust trust);
  /// One that is kept without a position is replaced in the drive.
  void drop_canary();
  /// Returns once a restart finds no position.
  Task<Result<void>> forget_saved_position();
  /// Returns once a restart finds that one.
  Task<Result<void>> journal_offset(std::int64_t offset, PositionTrust trust);

 private:
  const AxisContext& context_;
  const Shaft& shaft_;
  const PowerMachine& power_;
  const AxisLife& life_;

  bool owns_canary_ = false;
};

}  // namespace axisd
