// Where a motion starts from, and where it goes: judged as shortly before the trigger as it takes (M19).
#pragma once

#include "buses/task.hpp"
#include "devices/axis/activity.hpp"
#include "devices/axis/axis_context.hpp"
#include "devices/axis/shaft.hpp"

namespace axisd {

class Execution;
class Readings;
class SavedPosition;
class StateReader;

/// Plans anew from where the shaft is, checks the way, and keeps the drive's counter within its range.
/// Thread: core.
class MotionAim {
 public:
  MotionAim(const AxisContext& context, Shaft& shaft, Execution& execution, StateReader& reader,
            Readings& readings, SavedPosition& saved)
      : context_(context),
        shaft_(shaft),
        execution_(execution),
        reader_(reader),
        readings_(readings),
        saved_(saved) {}
  MotionAim(const MotionAim&) = delete;

  /// Plans its motion anew. Errors: as of Planner::move(); soft_limit.
  Result<void> aim(Activity& activity);
  /// The drive would go as far as was asked, and that way. Errors: moving, soft_limit.
  [[nodiscard]] Result<void> check_way(const Activity& activity) const;
  /// Zeroes the drive's counter before its target could leave that. Errors: as of Drive::clear_position().
  Task<Result<void>> make_room(ActivityPtr activity);

 private:
  [[nodiscard]] Result<void> check_direction(const Activity& activity,
                                             const PositionTracker::Target& target) const;
  Task<bool> counter_shows_zero();

  const AxisContext& context_;
  Shaft& shaft_;
  Execution& execution_;
  StateReader& reader_;
  Readings& readings_;
  SavedPosition& saved_;
};

}  // namespace axisd
