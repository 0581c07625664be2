// What a request would be as a motion.
#pragma once

#include <optional>

#include "devices/axis/axis_context.hpp"
#include "devices/axis/shaft.hpp"

namespace axisd {

class Execution;

/// Plans from where the shaft is, or will be when what is accepted is done. Pure looking. Thread: core.
class MotionPlans {
 public:
  MotionPlans(const AxisContext& context, const Shaft& shaft, const Execution& execution)
      : context_(context), shaft_(shaft), execution_(execution) {}
  MotionPlans(const MotionPlans&) = delete;

  /// A move from where the shaft is. Errors: out_of_range, soft_limit.
  [[nodiscard]] Result<Plan> plan_move(const PositionTracker::Target& target, const MotionValues& with) const;
  /// A motion at a velocity, as a move to its end where it can have one (M16).
  [[nodiscard]] Result<Plan> plan_velocity(double velocity, const MotionValues& with, bool jog) const;
  /// Where a motion at a velocity ends if nobody ends it; nullopt: nowhere. Errors: soft_limit, not_trusted.
  [[nodiscard]] Result<std::optional<PositionTracker::Target>> end_of_velocity(bool positive, bool jog) const;
  /// Where the axis will stand when everything that is accepted is done; nullopt: that has no end of its own.
  [[nodiscard]] std::optional<PositionTracker> expected_end() const;
  /// What it will be, as far as can be told before its turn.
  [[nodiscard]] Result<Plan> plan_behind(const Action& action, const PositionTracker& from) const;

 private:
  const AxisContext& context_;
  const Shaft& shaft_;
  const Execution& execution_;
};

}  // namespace axisd
