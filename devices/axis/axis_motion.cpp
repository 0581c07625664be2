// Sequences. Each reads top to bottom; after every wait it asks whether it is still current, and leaves if
// not.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "devices/axis/axis.hpp"
#include "devices/axis/axis_log.hpp"
#include "devices/axis/chain.hpp"

namespace axisd {

bool Axis::current(const Activity& activity) const {
  return activity_.get() == &activity && context_.gate->epoch() == activity.epoch;
}

MotionGuard Axis::guard(const Activity& activity) const {
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
ActivityPtr Axis::take_activity() {
  if (activity_) {
    activity_->late.reset();
    activity_->turn.leave();
  }
  return std::exchange(activity_, nullptr);
}

void Axis::finish(Activity& activity, const std::function<void(CommandRecord&)>& how) {
  if (activity_.get() != &activity) return;
  const auto keep = take_activity();
  how(*keep->command);
  const auto& command = keep->command->value();
  if (command.state == CommandState::done)
    start_next();
  else
    drop_buffer(*command.cause);
  publish();
}

/// A motion that ends by an error of its own leaves the axis in ErrorStop (PLCopen part 1, 3.2); a start that
/// is known not to have been executed does not.
void Axis::fail_with_stop(Activity& activity, Error cause) {
  if (activity_.get() != &activity) return;
  if (cause.outcome != Outcome::not_executed) {
    enter_error_stop(cause);
  } else {
    revoke_motion();
    leave_running(activity);
    note_motion_to_stop();
    finish(activity, [&](CommandRecord& command) { command.error(std::move(cause)); });
  }
  begin_stop(StopKind::stop, nullptr);
  publish();
}

/// A terminal brought the drive to rest, and may let go of it again: what the drive was told would still
/// stand then (in velocity mode 60FFh is followed as a level), so it is taken back (M1).
void Axis::abort_at_rest(Activity& activity, Error cause) {
  if (activity_.get() != &activity) return;
  revoke_motion();
  leave_running(activity);
  begin_stop(StopKind::halt, nullptr);
  finish(activity, [&](CommandRecord& command) { command.abort(std::move(cause)); });
}

void Axis::enter_error_stop(const Error& cause) {
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

/// Waits for a sample whose request went out at `since` or later.
Task<Result<DriveSample>> Axis::sample_after(TimePoint since, Duration patience) {
  const auto deadline = context_.env.clock->now() + patience;
  wake();
  while (context_.env.clock->now() < deadline && !link_.offline()) {
    if (shaft_.sample() && shaft_.sample()->asked_at >= since) co_return *shaft_.sample();
    co_await shaft_.sampled().wait_until(deadline);
  }
  co_return fail(
      context_.error(Reason::no_reply, "the drive could not be read back", "check power and wiring"));
}

/// Lets a halt in progress end. False: no longer current.
Task<bool> Axis::reach_standstill(ActivityPtr activity) {
  while (stop_.under_way() && current(*activity)) co_await stopped_.wait();
  if (!current(*activity)) co_return false;
  if (fault_) {
    finish(*activity, [this](CommandRecord& command) { command.error(*fault_); });
    co_return false;
  }
  activity->start.standstill();
  co_return true;
}

Task<> Axis::run_move(ActivityPtr activity) {
  if (!co_await positioned(activity)) co_return;
  shaft_.tracker().reached(*activity->plan.target, context_.drive->position_window());
  remember_position();
  finish(*activity, [](CommandRecord& command) { command.done(); });
}

/// What was true at its acceptance, or before the disk was waited for, may have changed. False: the activity
/// has ended, and nothing was sent.
bool Axis::may_start(Activity& activity) {
  const bool moved = shaft_.found_in_motion();
  if (!moved && (!activity.plan.trusted || shaft_.tracker().trust() != PositionTrust::unknown)) return true;
  auto cause = moved
                   ? context_.moved_before_start()
                   : context_.error(Reason::not_trusted, "the position was lost before the move could start",
                                    "home the axis, or set its position");
  tell_part(activity, cause);
  finish(activity, [&](CommandRecord& command) { command.error(std::move(cause)); });
  return false;
}

/// Lets others start that asked before; then nobody else does until the turn is left (M6). False: the
/// activity has ended, and nothing was sent.
Task<bool> Axis::take_turn(ActivityPtr activity) {
  auto* turns = context_.env.bus->start_turns();
  if (turns == nullptr) co_return true;
  activity->start.queue();
  if (!activity->turn) activity->turn = turns->announce();
  co_await turns->take(activity->turn);
  if (!current(*activity)) co_return false;
  had_turn_ = context_.env.clock->now();
  activity->start.has_turn();
  co_return true;
}

/// One positioning motion to the plan's target. False: the activity has ended.
Task<bool> Axis::positioned(ActivityPtr activity) {
  if (!co_await reach_standstill(activity)) co_return false;
  auto result = co_await look(context_.settings.reboot_guard);
  if (!current(*activity) || !may_start(*activity)) co_return false;
  if (result) result = aim(*activity);
  if (result) result = co_await make_room(activity);
  if (!current(*activity)) co_return false;
  if (result &&
      !co_await noted(activity, note_of(*activity, context_.drive->marks_until(profile_of(activity->plan)))))
    co_return false;
  std::int64_t base = 0;
  bool there = false;
  {
    if (result && !co_await take_turn(activity)) co_return false;
    const Chain chain(*this);
    if (result) result = co_await look(context_.settings.reboot_guard);
    if (!current(*activity) || !may_start(*activity)) co_return false;
    if (result) result = check_way(*activity);
    base = shaft_.tracker().counter();
    const auto& target = *activity->plan.target;
    there = result && shaft_.tracker().rests_at(target);
    if (result && !there) {
      activity->plan.predicted = context_.planner.duration(activity->plan, target.counter - base);
      if (context_.may_move_by_itself()) {
        auto triggered = co_await start_unmoved(activity);
        if (!triggered) {
          stop_.unseen_start().not_sent(activity->number);
          co_return false;
        }
        result = *std::move(triggered);
        base = shaft_.tracker().counter();
      } else {
        activity->number = stop_.unseen_start().sending(base, context_.env.clock->now());
        result = co_await context_.drive->start_move(profile_of(activity->plan), guard(*activity));
      }
      if (result || result.error().outcome == Outcome::unknown) shaft_.tracker().forget_base();
    }
  }
  result && !there ? activity->turn.done() : activity->turn.leave();
  const auto since = context_.env.clock->now();
  if (there) {  // nothing to do, and nothing is sent
    activity->command->activate();
    co_return co_await is_no_reboot(activity) && co_await still_there(activity);
  }
  if (!co_await started(activity, std::move(result), base, since)) co_return false;
  co_return (co_await arrived(activity, base, since)).has_value();
}

Task<> Axis::run_velocity(ActivityPtr activity) {
  if (!activity->plan.endless) {
    // Without a known position a jog is bounded by its travel alone: from where the shaft is (M16).
    if (activity->plan.target->distance) shaft_.tracker().forget_base();
    if (!co_await positioned(activity)) co_return;
    shaft_.tracker().reached(*activity->plan.target, context_.drive->position_window());
    remember_position();
    const bool jog = activity->command->value().kind == CommandKind::jog;
    const auto& limits = context_.settings.limits;
    const auto left = activity->plan.positive ? *limits.position_maximum - shaft_.tracker().position()
                                              : shaft_.tracker().position() - *limits.position_minimum;
    const bool short_of_it =
        context_.scale.to_pulses(left) * (context_.scale.pulses_per_unit() < 0 ? -1 : 1) >
        context_.target_tolerance() + 1;
    auto cause =
        short_of_it ? context_.error(Reason::out_of_range,
                                     "reached the end of the drive's longest single motion", "start it again")
                    : context_.error(Reason::soft_limit, "reached the software limit", "move the other way");
    finish(*activity,
           [&](CommandRecord& command) { jog ? command.done() : command.abort(std::move(cause)); });
    co_return;
  }
  if (!co_await reach_standstill(activity)) co_return;
  const VelocityProfile profile{.velocity_rpm = activity->plan.velocity_rpm,
                                .start_rpm = activity->plan.start_rpm,
                                .acceleration_time = activity->plan.acceleration_time,
                                .deceleration_time = activity->plan.deceleration_time};
  if (!co_await noted(activity, note_of(*activity, context_.drive->marks_until(profile)))) co_return;
  Result<void> result;
  std::int64_t base = 0;
  {
    if (!co_await take_turn(activity)) co_return;
    const Chain chain(*this);
    if (activity->turn) result = co_await look(context_.settings.reboot_guard);  // it may have waited long
    if (!current(*activity) || !may_start(*activity)) co_return;
    base = shaft_.tracker().counter();
    if (result) {
      activity->number = stop_.unseen_start().sending(base, context_.env.clock->now());
      result = co_await context_.drive->start_velocity(profile, guard(*activity));
    }
  }
  result ? activity->turn.done() : activity->turn.leave();
  const auto since = context_.env.clock->now();
  if (!co_await started(activity, std::move(result), base, since)) co_return;
  activity->motion = followed(activity->plan, base, since);
  co_await follow(activity, base, since);
}

/// What the gate no longer let out was overtaken by time or by another client: nobody's error.
void Axis::end_unsent(Activity& activity, Error cause) {
  if (cause.reason == Reason::expired && context_.env.clock->now() > activity.start_by)
    cause = late(activity, cause);
  const bool aborted = cause.reason == Reason::expired || cause.reason == Reason::lease_lost;
  finish(activity, [&](CommandRecord& command) { aborted ? command.abort(cause) : command.error(cause); });
}

/// What became of a start. True: it was executed. A trigger of which the reply does not say so is never sent
/// again: the drive is read back until it shows what it did (M8).
Task<bool> Axis::started(ActivityPtr activity, Result<void> result, std::int64_t base, TimePoint since) {
  const bool sent = result || result.error().outcome == Outcome::unknown;
  if (sent)
    stop_.unseen_start().sent(activity->number, since);
  else
    stop_.unseen_start().not_sent(activity->number);
  if (!current(*activity)) co_return false;
  if (sent) activity->start.begun();
  watch_speed(SpeedWatch::Event::begun);
  if (result) {
    // A proof was part of it, no longer than `reboot_guard` before the trigger; that has its reply since.
    continuity_.proven(context_.drive->proven_at().value_or(since - 2 * context_.settings.reboot_guard));
    activity->command->activate();
    publish();
    co_return true;
  }
  auto cause = result.error();
  if (cause.reason == Reason::rebooted) {
    on_reboot(cause);
    co_return false;
  }
  if (cause.reason == Reason::terminal) {
    on_turned_by_power(cause);
    co_return false;
  }
  if (cause.outcome != Outcome::unknown) {
    tell_part(*activity, cause);
    end_unsent(*activity, cause);
    co_return false;
  }
  co_return co_await read_back(activity, std::move(cause), base, since);
}

}  // namespace axisd
