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

  /// From now on it has to start in time. `waited`: in the buffer, by its own wish; `halting`: for a motion
  /// to end.
  void bound_start(const ActivityPtr& activity, bool waited, bool halting);
  /// No start frame of it goes out after `latest`; the time counts from `since`.
  void start_by(const ActivityPtr& activity, TimePoint since, TimePoint latest);
  /// Nothing was sent for it, as it would have been too late. `cause`: where that was found.
  [[nodiscard]] Error late(const Activity& activity, Error cause) const;
  /// Ends it: nothing of it was sent, or it was refused.
  void end_unsent(Activity& activity, Error cause);
  /// By what a restart tells whether its start was executed.
  [[nodiscard]] SendingNote note_of(const Activity& activity, std::vector<ContinuityMark> marks) const;
  /// Makes it known to a restart, before anything is sent for it that may move. False: it has ended.
  Task<bool> noted(ActivityPtr activity, SendingNote note);
  /// What was true at its acceptance holds still. False: it has ended.
  bool may_start(Activity& activity);
  /// Waits for its turn to start on its line (M6). False: it has ended.
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
