// Acceptance: what is permitted (axis_preconditions) becomes a command, before the wire is touched.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "devices/axis/axis.hpp"
#include "devices/axis/power_wait.hpp"

namespace axisd {

namespace {

bool is_motion(CommandKind kind) {
  return kind != CommandKind::enable && kind != CommandKind::reset && kind != CommandKind::set_position;
}

/// The journal was lost: what has to be done first, and that the request may have been executed before.
Error with_doubt(Error unaccepted, const Error& doubt) {
  unaccepted.message += "; " + doubt.message;
  unaccepted.remedy += "; then " + doubt.remedy;
  unaccepted.outcome = doubt.outcome;
  return unaccepted;
}

}  // namespace

Result<CommandPtr> Axis::submit(const Action& action, const CommandOptions& options) {
  accept_epoch_ = context_.gate->epoch();
  // Stops and disables are never deduplicated: each one is executed.
  if (std::holds_alternative<StopRequest>(action) || std::holds_alternative<DisableRequest>(action)) {
    context_.gate->stop_served();
    stop_.arrived(options.arrived);
    auto always = options;
    always.request_id.clear();
    return std::visit([&](const auto& request) { return accept(request, always); }, action);
  }
  auto repeat = context_.env.book->find_repeat(context_.settings.name, action, options);
  if (repeat && *repeat != nullptr) renew_hold(*repeat, options);
  const bool doubtful = !repeat && repeat.error().outcome == Outcome::unknown;
  if (doubtful && is_motion(kind_of(action)) && context_.env.state_unaccepted != nullptr &&
      *context_.env.state_unaccepted)
    return fail(with_doubt(**context_.env.state_unaccepted, repeat.error()));
  if (!repeat || *repeat != nullptr) return repeat;
  const bool for_power = buffer_.empty() && waits_for_power(activity_, action);
  if (options.buffer_mode == BufferMode::buffered || for_power) return accept_buffered(action, options);
  return std::visit([&](const auto& request) { return accept(request, options); }, action);
}

/// The hold counts from when its call arrived: whoever let go since then is not kept moving.
TimePoint Axis::held_until(const CommandOptions& options, Duration hold) const {
  const auto now = context_.env.clock->now();
  return (options.arrived == TimePoint{} ? now : std::min(now, options.arrived)) + hold;
}

/// A held motion is being executed, and its hold is not over.
bool Axis::holds() const {
  return activity_ && activity_->hold_until && context_.env.clock->now() < *activity_->hold_until &&
         current(*activity_);
}

/// A repeated jog (or held velocity) extends the motion that it started, and never starts one that has ended.
void Axis::renew_hold(const CommandPtr& command, const CommandOptions& options) {
  if (!holds() || activity_->command != command) return;
  const auto until = held_until(options, command->value().asked.hold.value_or(Duration{0}));
  activity_->hold_until = std::max(*activity_->hold_until, until);
}

template <class Request>
Result<void> Axis::permit(const Request& request, const CommandOptions& options) const {
  Obstacles found;
  look_at(request, options, found);
  return found.verdict();
}

/// Enters a command and makes it the one that is executed; whatever was executed before is aborted and
/// halted.
ActivityPtr Axis::begin(const Action& action, const CommandOptions& options, AxisState state, Plan plan) {
  const bool waited = buffer_.starts();
  auto command =
      waited ? buffer_.take_starting() : context_.env.book->open(context_.settings.name, action, options);
  const auto replaced = activity_;
  const bool moving =
      (replaced && replaced->state != AxisState::standstill) || (shaft_.sample() && shaft_.sample()->moving);
  note_motion_to_stop();
  if (replaced)
    supersede(context_.error(Reason::superseded, fmt::format("replaced by {} {}", to_string(kind_of(action)),
                                                             command->value().id)));
  // M9: what a start in motion does is not in the manuals, so the motion is ended first.
  if (moving && !stop_.under_way()) begin_stop(StopKind::halt, nullptr);
  command->grant(plan.granted);
  activity_ = std::make_shared<Activity>(Activity{.command = std::move(command),
                                                  .state = state,
                                                  .epoch = accept_epoch_,
                                                  .options = options,
                                                  .plan = std::move(plan)});
  const bool by_own_wish = waited && options.buffer_mode == BufferMode::buffered;
  bound_start(activity_, by_own_wish, moving || stop_.under_way());
  // A group has one for all its members.
  auto* turns = context_.env.bus->start_turns();
  if (turns != nullptr && state != AxisState::standstill && state != AxisState::synchronized_motion)
    activity_->turn = turns->announce();
  publish();
  return activity_;
}

Result<CommandPtr> Axis::accept(const EnableRequest& request, const CommandOptions& options) {
  if (auto permitted = permit(request, options); !permitted) return fail(permitted.error());
  context_.env.bus->about_to_energise();
  const auto activity = begin(request, options, AxisState::standstill, {});
  // Not yet enabled: state() follows the drive's own bit.
  launch(run_enable(activity), "enable");
  return activity->command;
}

Result<CommandPtr> Axis::accept(const DisableRequest& request, const CommandOptions& options) {
  if (auto permitted = permit(request, options); !permitted) return fail(permitted.error());
  supersede(context_.error(Reason::superseded, "the axis is being disabled"));
  begin_stop(StopKind::stop, nullptr);
  const auto activity = begin(request, options, AxisState::standstill, {});
  launch(run_disable(activity), "disable");
  return activity->command;
}

Result<CommandPtr> Axis::accept(const HomeRequest& request, const CommandOptions& options) {
  if (auto permitted = permit(request, options); !permitted) return fail(permitted.error());
  Plan plan;
  plan.granted.velocity = context_.settings.homing->velocity;
  plan.granted.search_velocity = context_.settings.homing->search_velocity;
  plan.granted.acceleration_time = context_.settings.homing->acceleration_time;
  plan.deceleration_time = context_.planner.braking_time(context_.settings.homing->velocity,
                                                         context_.settings.homing->acceleration_time);
  const auto activity = begin(request, options, AxisState::homing, std::move(plan));
  launch(run_home(activity), "home");
  return activity->command;
}

Result<Plan> Axis::plan_move(const PositionTracker::Target& target, const MotionValues& with) const {
  const auto profile = context_.planner.profile(context_.velocity_of(with), with);
  if (!profile) return fail(profile.error());
  return context_.planner.move(*profile, target, shaft_.tracker());
}

Result<CommandPtr> Axis::accept(const MoveAbsoluteRequest& request, const CommandOptions& options) {
  if (auto permitted = permit(request, options); !permitted) return fail(permitted.error());
  auto plan = plan_move(context_.target_of(request, shaft_.tracker()), request.with);
  if (!plan) return fail(plan.error());
  plan->trusted = context_.settings.require_trust;
  const auto activity = begin(request, options, AxisState::discrete_motion, *plan);
  launch(run_move(activity), "move");
  return activity->command;
}

Result<CommandPtr> Axis::accept(const MoveRelativeRequest& request, const CommandOptions& options) {
  if (auto permitted = permit(request, options); !permitted) return fail(permitted.error());
  auto plan = plan_move(shaft_.tracker().plan_relative(request.distance), request.with);
  if (!plan) return fail(plan.error());
  const auto activity = begin(request, options, AxisState::discrete_motion, *plan);
  launch(run_move(activity), "move");
  return activity->command;
}

/// M16: nothing on these drives notices a dead daemon or cable, so a motion without end gets one where it
/// can: the software limit of an axis that knows its position, `jog_travel` for one that does not.
Result<std::optional<PositionTracker::Target>> Axis::end_of_velocity(bool positive, bool jog) const {
  const auto& limits = context_.settings.limits;
  if (!limits.position_minimum) return std::nullopt;
  PositionTracker::Target target{};
  if (shaft_.tracker().trust() != PositionTrust::unknown) {
    target = shaft_.tracker().plan_absolute(positive ? *limits.position_maximum : *limits.position_minimum);
    const auto way = target.position - shaft_.tracker().position();
    // A measured position wavers: within its window it is at the limit (M30).
    const bool there =
        std::abs(target.counter - shaft_.tracker().counter()) <= context_.drive->position_window();
    if (there || (positive ? way <= 0 : way >= 0))
      return fail(Error{.reason = Reason::soft_limit,
                        .message = fmt::format("{}: at the software limit already", context_.settings.name),
                        .remedy = "move the other way",
                        .permitted = Range{.minimum = *limits.position_minimum,
                                           .maximum = *limits.position_maximum,
                                           .unit = context_.settings.scale.unit}});
  } else if (jog && context_.settings.jog_travel > 0) {
    target = shaft_.tracker().plan_relative(positive ? context_.settings.jog_travel
                                                     : -context_.settings.jog_travel);
  } else {
    auto lost = context_.not_trusted("the position is unknown, so limits cannot be kept");
    if (jog) lost.remedy = "configure jog_travel to jog an axis that is not homed; or " + lost.remedy;
    return fail(std::move(lost));
  }
  // The limit may be further away than the drive takes as a target: then the motion ends before it.
  const auto way = static_cast<double>(target.counter - shaft_.tracker().counter());
  if (const auto longest = static_cast<double>(context_.planner.longest_move()); std::abs(way) > longest)
    target = shaft_.tracker().plan_relative((target.position - shaft_.tracker().position()) *
                                            (longest / std::abs(way)) * 0.999);
  return target;
}

Result<Plan> Axis::plan_velocity(double velocity, const MotionValues& with, bool jog) const {
  auto profile = context_.planner.profile(velocity, with);
  if (!profile) return profile;
  profile->positive = velocity > 0;
  profile->granted.velocity = std::copysign(*profile->granted.velocity, velocity);
  const auto end = end_of_velocity(profile->positive, jog);
  if (!end) return fail(end.error());
  if (!*end) {
    profile->endless = true;
    if (profile->positive == context_.settings.scale.invert) profile->velocity_rpm = -profile->velocity_rpm;
    return profile;
  }
  const auto velocity_granted = profile->granted.velocity;
  auto plan = context_.planner.move(*profile, **end, shaft_.tracker());
  if (plan) plan->granted.velocity = velocity_granted;
  if (plan) plan->trusted = shaft_.tracker().trust() != PositionTrust::unknown;
  return plan;
}

/// A repeated call with the same velocity extends the held motion that it started.
bool Axis::renews(const Action& action, const CommandOptions& options) const {
  if (!holds()) return false;
  const auto& known = activity_->command->value();
  const auto velocity = std::visit(
      [](const auto& request) -> std::optional<double> {
        if constexpr (requires { request.velocity; }) return request.velocity;
        return std::nullopt;
      },
      action);
  return known.kind == kind_of(action) && known.asked.velocity == velocity &&
         activity_->options.client == options.client && activity_->options.lease_token == options.lease_token;
}

CommandPtr Axis::renew(const Action& action, const CommandOptions& options, Duration hold) {
  // Should this very call be repeated later, also after a crash, it belongs to this command, too, and starts
  // nothing: it counts once that is known.
  context_.env.book->attach(
      activity_->command, context_.settings.name, action, options,
      [activity = std::weak_ptr(activity_), until = held_until(options, hold)](const Result<void>& known) {
        if (const auto held = activity.lock(); held && known)
          held->hold_until = std::max(held->hold_until.value_or(until), until);
      });
  return activity_->command;
}

Result<CommandPtr> Axis::accept(const MoveVelocityRequest& request, const CommandOptions& options) {
  if (auto permitted = permit(request, options); !permitted) return fail(permitted.error());
  if (request.hold && renews(request, options)) return renew(request, options, *request.hold);
  auto plan = plan_velocity(request.velocity, request.with, false);
  if (!plan) return fail(plan.error());
  plan->granted.hold = request.hold;
  const auto activity = begin(request, options, AxisState::continuous_motion, *plan);
  if (request.hold) activity->hold_until = held_until(options, *request.hold);
  launch(run_velocity(activity), "velocity");
  return activity->command;
}

Result<CommandPtr> Axis::accept(const JogRequest& request, const CommandOptions& options) {
  if (auto permitted = permit(request, options); !permitted) return fail(permitted.error());
  if (renews(request, options)) return renew(request, options, request.hold);
  auto plan = plan_velocity(request.velocity, request.with, true);
  if (!plan) return fail(plan.error());
  plan->granted.hold = request.hold;
  const auto activity = begin(request, options, AxisState::continuous_motion, *plan);
  activity->hold_until = held_until(options, request.hold);
  launch(run_velocity(activity), "jog");
  return activity->command;
}

Result<CommandPtr> Axis::accept(const StopRequest& request, const CommandOptions& options) {
  auto command = context_.env.book->open(context_.settings.name, request, options);
  execute_stop(request, options, command);
  return command;
}

void Axis::execute_stop(const StopRequest& request, const CommandOptions& options, CommandPtr command) {
  note_motion_to_stop();
  supersede(context_.error(Reason::superseded,
                           fmt::format("{} {} by {}", to_string(command->value().kind), command->value().id,
                                       options.client.empty() ? "the daemon" : options.client)));
  // The drive keeps the deceleration that was set before the motion: the answer says which (M12).
  if (const auto braking = braking_time(request.kind);
      request.kind != StopKind::quick_stop || braking > Duration{})
    command->grant({.deceleration_time = braking});
  if (options.arrived != TimePoint{}) observed_.stop_requested(options.arrived, request.all);
  begin_stop(request.kind, std::move(command));
  publish();
}

Result<CommandPtr> Axis::accept(const ResetRequest& request, const CommandOptions& options) {
  if (auto permitted = permit(request, options); !permitted) return fail(permitted.error());
  const auto activity = begin(request, options, AxisState::standstill, {});
  launch(run_reset(activity), "reset");
  return activity->command;
}

Result<CommandPtr> Axis::accept(const SetPositionRequest& request, const CommandOptions& options) {
  if (auto permitted = permit(request, options); !permitted) return fail(permitted.error());
  const auto activity = begin(request, options, AxisState::standstill, {});
  launch(run_set_position(activity), "set position");
  return activity->command;
}

Result<CommandPtr> Axis::cancel(const CommandPtr& command, TimePoint arrived) {
  if (cancel_buffered(command)) {
    publish();
  } else if (activity_ && activity_->command == command) {
    stop_.arrived(arrived);
    note_motion_to_stop();
    supersede(context_.error(Reason::cancelled, "cancelled by a client"));
    begin_stop(StopKind::halt, nullptr);
    publish();
  }
  return command;
}

}  // namespace axisd
