// What an axis is executing, and what waits for it.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <utility>

#include "devices/axis/activity.hpp"
#include "devices/axis/axis_context.hpp"
#include "devices/axis/command_buffer.hpp"
#include "devices/axis/shaft.hpp"
#include "devices/axis/snapshot.hpp"
#include "devices/axis/stop_machine.hpp"

namespace axisd {

class Acceptance;
class Publisher;
class Stopper;

/// Owns the activity, the commands that wait, and the fault of ErrorStop. Each end of an activity passes
/// here: what was prepared for it is revoked, its command ends once, and what waits is started or dropped.
/// Thread: core.
class Execution {
 public:
  Execution(const AxisContext& context, Shaft& shaft, StopMachine& stop, Stopper& stopper,
            Publisher& publisher, Acceptance& acceptance)
      : context_(context),
        shaft_(shaft),
        stop_(stop),
        stopper_(stopper),
        publisher_(publisher),
        acceptance_(acceptance) {}
  Execution(const Execution&) = delete;

  /// nullptr: nothing is executed.
  [[nodiscard]] const ActivityPtr& activity() const { return activity_; }
  /// Precondition: nothing is executed.
  void begin(ActivityPtr activity) { activity_ = std::move(activity); }
  /// Commands that wait for the one before them (PLCopen BufferMode Buffered).
  [[nodiscard]] CommandBuffer& buffer() { return buffer_; }
  [[nodiscard]] const CommandBuffer& buffer() const { return buffer_; }

  /// Why the axis is in ErrorStop.
  [[nodiscard]] const std::optional<Error>& fault() const { return fault_; }
  void set_fault(Error cause) { fault_ = std::move(cause); }
  /// As a fault, where there is none yet.
  void note_fault(const Error& cause) {
    if (!fault_) fault_ = cause;
  }
  void clear_fault() { fault_.reset(); }

  /// A request is being accepted: a stop that is raised from now on makes it old.
  void accept_now() { accept_epoch_ = context_.gate->epoch(); }
  [[nodiscard]] std::uint64_t accept_epoch() const { return accept_epoch_; }

  [[nodiscard]] bool current(const Activity& activity) const;
  [[nodiscard]] MotionGuard guard(const Activity& activity) const;
  /// A held motion is being executed, and its hold is not over.
  [[nodiscard]] bool holds() const;
  [[nodiscard]] AxisState state() const;
  [[nodiscard]] bool busy() const;
  /// Busy, and not only because its start bides its time.
  [[nodiscard]] bool works() const;
  /// Nothing moves, as far as is known, and no stop is under way.
  [[nodiscard]] bool at_rest() const;

  /// Nothing of motion that was prepared so far is sent any more.
  void revoke_motion();
  void supersede(const Error& cause);
  /// Before the activity ends: the stop that follows shows what it ends.
  void note_motion_to_stop();
  void leave_running(const Activity& activity);
  ActivityPtr take_activity();
  void finish(Activity& activity, const std::function<void(CommandRecord&)>& how);
  void fail_with_stop(Activity& activity, Error cause);
  void abort_at_rest(Activity& activity, Error cause);
  void enter_error_stop(const Error& cause);
  void drop_buffer(const Error& cause);
  bool cancel_buffered(const CommandPtr& command);

 private:
  /// Its start waits for those of others, or for its moment: its drive rests until then.
  [[nodiscard]] bool bides() const;
  void end_waiting(const std::deque<Buffered>& commands, const Error& cause);

  const AxisContext& context_;
  Shaft& shaft_;
  StopMachine& stop_;
  Stopper& stopper_;
  Publisher& publisher_;
  Acceptance& acceptance_;

  ActivityPtr activity_;
  CommandBuffer buffer_;
  std::optional<Error> fault_;
  std::uint64_t accept_epoch_ = 0;  ///< of the request being accepted: a stop raised meanwhile makes it old
};

}  // namespace axisd
