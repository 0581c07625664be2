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

  [[nodiscard]] Result<Plan> plan_move(const PositionTracker::Target& target, const MotionValues& with) const;
  [[nodiscard]] Result<Plan> plan_velocity(double velocity, const MotionValues& with, bool jog) const;
  /// Where a motion at a velocity ends if nobody ends it; nullopt: nowhere. Errors: soft_limit, not_trusted.
  [[nodiscard]] Result<std::optional<PositionTracker::Target>> end_of_velocity(bool positive, bool jog) const;
  [[nodiscard]] std::optional<PositionTracker> expected_end() const;
  [[nodiscard]] Result<Plan> plan_behind(const Action& action, const PositionTracker& from) const;

 private:
  const AxisContext& context_;
  const Shaft& shaft_;
  const Execution& execution_;
};

}  // namespace axisd
