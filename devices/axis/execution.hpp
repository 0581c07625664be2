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

  /// It is what is executed, and nothing has forbidden its motion since it was accepted.
  [[nodiscard]] bool current(const Activity& activity) const;
  /// Decides at each bind whether a frame of it may still go out.
  [[nodiscard]] MotionGuard guard(const Activity& activity) const;
  /// A held motion is being executed, and its hold is not over.
  [[nodiscard]] bool holds() const;
  /// As PLCopen names it (plcopen_state.hpp).
  [[nodiscard]] AxisState state() const;
  /// Something is executed, moves, or is to be stopped.
  [[nodiscard]] bool busy() const;
  /// Busy, and not only because its start bides its time.
  [[nodiscard]] bool works() const;
  /// Nothing moves, as far as is known, and no stop is under way.
  [[nodiscard]] bool at_rest() const;

  /// Nothing of motion that was prepared so far is sent any more.
  void revoke_motion();
  /// Ends what is executed as Aborted, and what waits behind it.
  void supersede(const Error& cause);
  /// Before the activity ends: the stop that follows shows what it ends.
  void note_motion_to_stop();
  /// Its command ends, and its drive may go on: the stop that follows knows its ramp.
  void leave_running(const Activity& activity);
  /// Nothing is executed any more; nullptr: nothing was.
  ActivityPtr take_activity();
  /// Ends its command as `how` says, and starts what waits, or drops it. Nothing where it is not executed.
  void finish(Activity& activity, const std::function<void(CommandRecord&)>& how);
  /// Ends it as Error, and stops the drive; in ErrorStop, unless it is known not to have been executed.
  void fail_with_stop(Activity& activity, Error cause);
  /// Ends it as Aborted where a terminal has brought the drive to rest.
  void abort_at_rest(Activity& activity, Error cause);
  /// ErrorStop: ends what is executed with the cause.
  void enter_error_stop(const Error& cause);
  /// Ends all that waits.
  void drop_buffer(const Error& cause);
  /// Ends one that waits, and those behind it. False: it does not wait.
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
