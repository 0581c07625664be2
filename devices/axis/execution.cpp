#include "devices/axis/execution.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "devices/axis/acceptance.hpp"
#include "devices/axis/axis_log.hpp"
#include "devices/axis/plcopen_state.hpp"
#include "devices/axis/publisher.hpp"
#include "devices/axis/stopper.hpp"

namespace axisd {

void Execution::revoke_motion() {
  context_.gate->raise();
  context_.env.bus->purge_superseded(context_.settings.node, *context_.gate);
}

/// Ends what is being executed. Nothing that was prepared for it is sent any more.
void Execution::supersede(const Error& cause) {
  ++accept_epoch_;
  revoke_motion();
  if (auto activity = take_activity()) {
    leave_running(*activity);
    auto told = cause;
    const bool enabling =
        activity->start.is_noted() && activity->command->value().kind == CommandKind::enable;
    if (activity->start.may_run() || enabling) told.outcome = Outcome::unknown;  // its start may be under way
    activity->command->abort(std::move(told));
    drop_buffer(cause);
  }
}

void Execution::note_motion_to_stop() {
  if (activity_ && activity_->state != AxisState::standstill) stop_.found_in_motion();
}

/// What the drive may go on with after its command has ended. A command that never started leaves the ramps
/// of the motion before it in force.
void Execution::leave_running(const Activity& activity) {
  if (!activity.start.may_run()) return;
  stop_.unseen_start().left(context_.env.clock->now());
  const auto& plan = activity.plan;
  stop_.set_deceleration(
      std::max(plan.deceleration_time, plan.granted.deceleration_time.value_or(Duration{})));
  if (activity.state != AxisState::standstill) stop_.leave_running();
}

bool Execution::current(const Activity& activity) const {
  return activity_.get() == &activity && context_.gate->epoch() == activity.epoch;
}

MotionGuard Execution::guard(const Activity& activity) const {
  auto token = activity.options.lease_token;
  if (activity.lease_over) token = MotionGuard::lease_is_over;
  if (activity.command->value().kind == CommandKind::disable) token = MotionGuard::needs_no_lease;
  // What nobody holds any more does not start, either.
  return {.gate = context_.gate,
          .epoch = activity.epoch,
          .fencing_token = token,
          .not_after = std::min({activity.options.not_after, activity.start_by,
                                 activity.hold_until.value_or(TimePoint::max())})};
}

/// It may be kept by whoever began it; nothing of it comes back to the axis.
ActivityPtr Execution::take_activity() {
  if (activity_) {
    activity_->late.reset();
    activity_->turn.leave();
  }
  return std::exchange(activity_, nullptr);
}

void Execution::finish(Activity& activity, const std::function<void(CommandRecord&)>& how) {
  if (activity_.get() != &activity) return;
  const auto keep = take_activity();
  how(*keep->command);
  const auto& command = keep->command->value();
  if (command.state == CommandState::done)
    acceptance_.start_next();
  else
    drop_buffer(*command.cause);
  publisher_.publish();
}

/// A motion that ends by an error of its own leaves the axis in ErrorStop (PLCopen part 1, 3.2); a start that
/// is known not to have been executed does not.
void Execution::fail_with_stop(Activity& activity, Error cause) {
  if (activity_.get() != &activity) return;
  if (cause.outcome != Outcome::not_executed) {
    enter_error_stop(cause);
  } else {
    revoke_motion();
    leave_running(activity);
    note_motion_to_stop();
    finish(activity, [&](CommandRecord& command) { command.error(std::move(cause)); });
  }
  stopper_.begin_stop(StopKind::stop, nullptr);
  publisher_.publish();
}

/// A terminal brought the drive to rest, and may let go of it again: what the drive was told would still
/// stand then (in velocity mode 60FFh is followed as a level), so it is taken back (M1).
void Execution::abort_at_rest(Activity& activity, Error cause) {
  if (activity_.get() != &activity) return;
  revoke_motion();
  leave_running(activity);
  stopper_.begin_stop(StopKind::halt, nullptr);
  finish(activity, [&](CommandRecord& command) { command.abort(std::move(cause)); });
}

void Execution::enter_error_stop(const Error& cause) {
  revoke_motion();
  if (!fault_ || fault_->reason != cause.reason || fault_->where.native_code != cause.where.native_code) {
    log_about_axis(spdlog::level::err, LogKind::axis_fault, context_.settings, to_string(cause));
    fault_ = cause;
  }
  if (auto activity = take_activity()) {
    leave_running(*activity);
    activity->command->error(cause);
    drop_buffer(cause);
  }
  shaft_.tracker().forget_base();
}

/// What was planned from where the command before it ends has no base without it.
void Execution::drop_buffer(const Error& cause) { end_waiting(buffer_.take_all(), cause); }

void Execution::end_waiting(const std::deque<Buffered>& commands, const Error& cause) {
  for (const auto& waiting : commands) {
    auto told = context_.error(Reason::superseded, "what it waited for was not done: " + cause.message,
                               "send it again, if it is still wanted");
    if (cause.reason == Reason::lease_lost) told.reason = cause.reason;
    told.outcome = Outcome::not_sent;
    waiting.command->abort(std::move(told));
  }
}

bool Execution::cancel_buffered(const CommandPtr& command) {
  auto leaving = buffer_.cut(command);
  if (leaving.empty()) return false;
  auto cause = context_.error(Reason::cancelled, "cancelled by a client");
  cause.outcome = Outcome::not_sent;
  command->abort(cause);
  leaving.pop_front();
  end_waiting(leaving, cause);
  return true;
}

bool Execution::busy() const {
  return activity_ || stop_.under_way() || stop_.owed() || shaft_.terminal_motion().moves() ||
         (shaft_.sample() && shaft_.sample()->moving);
}

bool Execution::works() const {
  const bool only_waits = bides() && !stop_.under_way() && !stop_.owed() &&
                          !shaft_.terminal_motion().moves() && !(shaft_.sample() && shaft_.sample()->moving);
  return busy() && !only_waits;
}

bool Execution::bides() const { return activity_ && activity_->start.bides(); }

bool Execution::at_rest() const {
  return !stop_.under_way() && !stop_.owed() && !(activity_ && activity_->state != AxisState::standstill) &&
         !(shaft_.sample() && shaft_.sample()->moving);
}

AxisState Execution::state() const {
  StateSources sources{.fault = fault_.has_value(), .stop = stop_.shown()};
  if (activity_) sources.executed = activity_->state;
  if (shaft_.sample()) sources.energised = shaft_.sample()->enabled;
  if (shaft_.sample() && shaft_.terminal_motion().moves()) sources.moved_by_terminal = shaft_.sample()->mode;
  return plcopen_state(sources);
}

bool Execution::holds() const {
  return activity_ && activity_->hold_until && context_.env.clock->now() < *activity_->hold_until &&
         current(*activity_);
}

}  // namespace axisd
