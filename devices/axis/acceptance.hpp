// Acceptance: what is permitted becomes a command, before the wire is touched.
#pragma once

#include "devices/axis/activity.hpp"
#include "devices/axis/axis_context.hpp"
#include "devices/axis/shaft.hpp"
#include "devices/axis/stop_machine.hpp"

namespace axisd {

class Execution;
class HomingSequence;
class MotionSequence;
class PowerSequence;
class Preconditions;
class Publisher;
class Sequences;
class StartWait;
class Stopper;

/// Enters commands and begins their sequences. What it decides is decided at once. Thread: core.
class Acceptance {
 public:
  Acceptance(const AxisContext& context, Sequences& sequences, Shaft& shaft, StopMachine& stop,
             Stopper& stopper, Execution& execution, const Preconditions& preconditions, StartWait& starts,
             MotionSequence& motion, HomingSequence& homing, PowerSequence& power_sequence,
             Publisher& publisher)
      : context_(context),
        sequences_(sequences),
        shaft_(shaft),
        stop_(stop),
        stopper_(stopper),
        execution_(execution),
        preconditions_(preconditions),
        starts_(starts),
        motion_(motion),
        homing_(homing),
        power_sequence_(power_sequence),
        publisher_(publisher) {}
  Acceptance(const Acceptance&) = delete;

  /// Accepts or refuses a request. What becomes of an accepted one is in its command.
  Result<CommandPtr> submit(const Action& action, const CommandOptions& options);
  /// Halts the axis if `command` is being executed.
  Result<CommandPtr> cancel(const CommandPtr& command, TimePoint arrived);
  /// A stop that was accepted for the axis before this one, and not executed.
  void take_stop(const StopRequest& request, const CommandOptions& options, CommandPtr command);
  /// Disables the axis, whatever it is doing. Never refused, nor repeated.
  void release(const CommandOptions& options);
  /// Enters a command and makes it the one that is executed; whatever was executed before is aborted and
  /// halted.
  ActivityPtr begin(const Action& action, const CommandOptions& options, AxisState state, Plan plan);
  /// What its part of a group move would be; nothing is begun yet.
  Result<Plan> plan_member(const GroupMemberRequest& request, const CommandOptions& options);
  /// What waits next becomes what is executed.
  void start_next();

 private:
  [[nodiscard]] TimePoint held_until(const CommandOptions& options, Duration hold) const;
  void renew_hold(const CommandPtr& command, const CommandOptions& options);
  template <class Request>
  [[nodiscard]] Result<void> permit(const Request& request, const CommandOptions& options) const;
  Result<CommandPtr> accept(const EnableRequest& request, const CommandOptions& options);
  Result<CommandPtr> accept(const DisableRequest& request, const CommandOptions& options);
  Result<CommandPtr> accept(const HomeRequest& request, const CommandOptions& options);
  Result<CommandPtr> accept(const MoveAbsoluteRequest& request, const CommandOptions& options);
  Result<CommandPtr> accept(const MoveRelativeRequest& request, const CommandOptions& options);
  Result<CommandPtr> accept(const MoveVelocityRequest& request, const CommandOptions& options);
  Result<CommandPtr> accept(const JogRequest& request, const CommandOptions& options);
  Result<CommandPtr> accept(const StopRequest& request, const CommandOptions& options);
  Result<CommandPtr> accept(const ResetRequest& request, const CommandOptions& options);
  Result<CommandPtr> accept(const SetPositionRequest& request, const CommandOptions& options);
  Result<CommandPtr> accept(const GroupMemberRequest& request, const CommandOptions& options) const;
  Result<CommandPtr> accept_buffered(const Action& action, const CommandOptions& options);
  void execute_stop(const StopRequest& request, const CommandOptions& options, CommandPtr command);
  CommandPtr renew(const Action& action, const CommandOptions& options, Duration hold);

  const AxisContext& context_;
  Sequences& sequences_;
  Shaft& shaft_;
  StopMachine& stop_;
  Stopper& stopper_;
  Execution& execution_;
  const Preconditions& preconditions_;
  StartWait& starts_;
  MotionSequence& motion_;
  HomingSequence& homing_;
  PowerSequence& power_sequence_;
  Publisher& publisher_;
};

}  // namespace axisd
