// Between the acceptance of a command and its first start frame: nothing starts late (M31).
#pragma once

#include <vector>

#include "buses/task.hpp"
#include "devices/axis/activity.hpp"
#include "devices/axis/axis_context.hpp"
#include "devices/axis/shaft.hpp"
#include "devices/axis/stop_machine.hpp"

namespace axisd {

class Execution;

/// Bounds that time, makes the command known to a restart, and waits for its turn on the line. What is too
/// late ends here. Thread: core.
class StartWait {
 public:
  StartWait(const AxisContext& context, const Shaft& shaft, const StopMachine& stop, Execution& execution)
      : context_(context), shaft_(shaft), stop_(stop), execution_(execution) {}
  StartWait(const StartWait&) = delete;

  void bound_start(const ActivityPtr& activity, bool waited, bool halting);
  void start_by(const ActivityPtr& activity, TimePoint since, TimePoint latest);
  [[nodiscard]] Error late(const Activity& activity, Error cause) const;
  void end_unsent(Activity& activity, Error cause);
  [[nodiscard]] SendingNote note_of(const Activity& activity, std::vector<ContinuityMark> marks) const;
  Task<bool> noted(ActivityPtr activity, SendingNote note);
  bool may_start(Activity& activity);
  Task<bool> take_turn(ActivityPtr activity);
  /// It is its turn to start now.
  void note_turn() { had_turn_ = context_.env.clock->now(); }
  /// The last time that it was its turn to start.
  [[nodiscard]] TimePoint had_turn() const { return had_turn_; }

 private:
  void end_late(Activity& activity);

  const AxisContext& context_;
  const Shaft& shaft_;
  const StopMachine& stop_;
  Execution& execution_;

  TimePoint had_turn_{};
};

}  // namespace axisd
