// Acceptance: everything that can be decided before the wire is touched.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "devices/axis/axis.hpp"

namespace axisd {

Result<CommandPtr> Axis::submit(const Action& action, const CommandOptions& options) {
  accept_epoch_ = gate_->epoch();
  // Stops and disables are never deduplicated: each one is executed.
  if (std::holds_alternative<StopRequest>(action) || std::holds_alternative<DisableRequest>(action)) {
    gate_->stop_served();
    auto always = options;
    always.request_id.clear();
    return std::visit([&](const auto& request) { return accept(request, always); }, action);
  }
  auto repeat = env_.book->find_repeat(settings_.name, action, options);
  if (repeat && *repeat != nullptr) renew_hold(*repeat);
  if (!repeat || *repeat != nullptr) return repeat;
  return std::visit([&](const auto& request) { return accept(request, options); }, action);
}

/// A repeated jog (or held velocity) extends the motion that it started, and never starts one that has ended.
void Axis::renew_hold(const CommandPtr& command) {
  if (!activity_ || activity_->command != command || !activity_->hold_until || !current(*activity_)) return;
  activity_->hold_until = env_.clock->now() + command->value().asked.hold.value_or(Duration{0});
}

Result<void> Axis::check_common(const CommandOptions& options) const {
  if (options.buffer_mode == BufferMode::buffered)
    return fail(error(Reason::not_supported, "buffered commands are not supported",
                      "wait for the command to end, or use aborting"));
  if (options.not_after <= env_.clock->now())
    return fail(
        error(Reason::expired, "the request's validity has passed", "repeat it with a later not_after"));
  return check_lease({.client = options.client, .lease_token = options.lease_token});
}

Result<void> Axis::check_online() const {
  if (link_ == LinkState::offline)
    return fail(error(Reason::offline, link_error_ ? "offline: " + to_string(*link_error_) : "offline",
                      "check power and wiring; it is retried by itself"));
  if (link_ == LinkState::configuring) {
    auto cause = error(Reason::configuring, "the drive is being identified and configured", "wait");
    if (link_error_) {
      cause = *link_error_;
      cause.message = fmt::format("{}: not configured: {}", settings_.name, link_error_->message);
      if (cause.reason != Reason::wrong_model && cause.reason != Reason::misconfigured)
        cause.reason = Reason::configuring;
      cause.outcome = Outcome::not_sent;
    }
    return fail(std::move(cause));
  }
  return {};
}

Result<void> Axis::check_ready(const CommandOptions& options) const {
  if (auto common = check_common(options); !common) return common;
  // A stop that the core has not seen yet comes before everything that is accepted now.
  if (gate_->stop_pending() || stopping_.hold || (stopping_.running && stopping_.kind > StopKind::halt))
    return fail(error(Reason::stopping, stopping_.hold ? "a stop is held" : "the axis is stopping",
                      stopping_.hold ? "release it: axisctl release-stop" : "wait for standstill"));
  if (fault_) {
    auto cause = *fault_;
    cause.message = fmt::format("{}: in ErrorStop: {}", settings_.name, fault_->message);
    cause.reason = fault_->reason == Reason::alarm ? Reason::alarm : Reason::fault;
    cause.remedy += cause.remedy.empty() ? "reset the axis" : "; then reset the axis";
    cause.outcome = Outcome::not_sent;
    return fail(std::move(cause));
  }
  if (auto free = check_maintenance(); !free) return free;
  if (auto kept = check_release(); !kept) return kept;
  if (!drift_.empty())
    return fail(error(Reason::misconfigured, "the drive no longer holds its configuration: " + drift_,
                      "disable the axis: the configuration is then applied again"));
  return check_online();
}

Result<void> Axis::check_maintenance() const {
  if (maintenance_.expired()) return {};
  return fail(error(Reason::busy, "the drive's parameters or memory are being written", "wait for it"));
}

Result<void> Axis::check_release() const {
  if (!release_owed_) return {};
  return fail(error(Reason::busy, "the drive is being released, because a lease ended", "wait for it"));
}

Result<void> Axis::check_motion(const CommandOptions& options) const {
  if (env_.inhibited != nullptr && *env_.inhibited)
    return fail(
        error(Reason::inhibited, "StopAll holds the machine", "release it: axisctl release-stop --all"));
  if (auto ready = check_ready(options); !ready) return ready;
  if (!sample_ || !sample_->enabled)
    return fail(error(Reason::disabled, "the power stage is off", "enable the axis first"));
  if (activity_ && activity_->command->value().kind == CommandKind::enable)
    return fail(error(Reason::disabled, "the axis is being enabled", "wait for the command to end"));
  if (activity_ && activity_->command->value().kind == CommandKind::disable)
    return fail(error(Reason::disabled, "the axis is being disabled", "enable it afterwards"));
  if (terminal_motion_)
    return fail(error(Reason::terminal, "a terminal of the drive moves it", "wait, or stop it"));
  return {};
}

Result<void> Axis::check_direction(bool positive) const {
  if (!limit_active(positive)) return {};
  return fail(error(Reason::limit_switch,
                    fmt::format("the {} limit switch is active", positive ? "positive" : "negative"),
                    "move away from it"));
}

/// Enters a command and makes it the one that is executed; whatever was executed before is aborted and
/// halted.
Axis::ActivityPtr Axis::begin(const Action& action, const CommandOptions& options, AxisState state,
                              Plan plan) {
  auto command = env_.book->open(settings_.name, action, options);
  const auto replaced = activity_;
  const bool moving = (replaced && replaced->state != AxisState::standstill) || (sample_ && sample_->moving);
  if (replaced)
    supersede(error(Reason::superseded,
                    fmt::format("replaced by {} {}", to_string(kind_of(action)), command->value().id)));
  // M9: what a start in motion does is not in the manuals, so the motion is ended first.
  if (moving && !stopping_.running) begin_stop(StopKind::halt, false, nullptr);
  command->grant(plan.granted);
  activity_ = std::make_shared<Activity>(Activity{.command = std::move(command),
                                                  .state = state,
                                                  .epoch = accept_epoch_,
                                                  .options = options,
                                                  .plan = std::move(plan)});
  publish();
  return activity_;
}

Result<CommandPtr> Axis::accept(const EnableRequest& request, const CommandOptions& options) {
  if (auto allowed = check_ready(options); !allowed) return fail(allowed.error());
  // A drive that turns while it is being enabled was moved by that, as far as can be told.
  if (!at_rest()) return fail(error(Reason::moving, "the axis moves", "wait for standstill"));
  if (activity_) return fail(error(Reason::busy, "another command is being executed", "wait for it"));
  env_.bus->about_to_energise();
  const auto activity = begin(request, options, AxisState::standstill, {});
  // Not yet enabled: state() follows the drive's own bit.
  launch(run_enable(activity), "enable");
  return activity->command;
}

Result<CommandPtr> Axis::accept(const DisableRequest& request, const CommandOptions& options) {
  // Also while the drive is not configured: some of its configuration is only written while it is released.
  if (link_ == LinkState::offline) return fail(check_online().error());
  supersede(error(Reason::superseded, "the axis is being disabled"));
  begin_stop(StopKind::stop, false, nullptr);
  const auto activity = begin(request, options, AxisState::standstill, {});
  launch(run_disable(activity), "disable");
  return activity->command;
}

Result<CommandPtr> Axis::accept(const HomeRequest& request, const CommandOptions& options) {
  if (auto allowed = check_motion(options); !allowed) return fail(allowed.error());
  if (!settings_.homing)
    return fail(
        error(Reason::not_supported, "no homing is configured", "add homing: to the axis in the YAML"));
  if (input_active(homing_switch()) && !settings_.homing->backoff)
    return fail(error(Reason::limit_switch, fmt::format("the {} switch is already active", homing_switch()),
                      "move away from it, or configure homing: { backoff: ... }"));
  Plan plan;
  plan.granted.velocity = settings_.homing->velocity;
  plan.granted.search_velocity = settings_.homing->search_velocity;
  plan.granted.acceleration_time = settings_.homing->acceleration_time;
  plan.deceleration_time = settings_.homing->acceleration_time;
  const auto activity = begin(request, options, AxisState::homing, std::move(plan));
  launch(run_home(activity), "home");
  return activity->command;
}

Result<Plan> Axis::plan_move(const PositionTracker::Target& target, const MotionValues& with) const {
  const auto profile = planner_.profile(with.velocity.value_or(planner_.maximum_velocity()), with);
  if (!profile) return fail(profile.error());
  auto plan = planner_.move(*profile, target, tracker_);
  if (!plan) return plan;
  if (target.counter != tracker_.counter())
    if (auto direction = check_direction(plan->positive); !direction) return fail(direction.error());
  return plan;
}

Result<CommandPtr> Axis::accept(const MoveAbsoluteRequest& request, const CommandOptions& options) {
  if (auto allowed = check_motion(options); !allowed) return fail(allowed.error());
  if (!std::isfinite(request.position))
    return fail(error(Reason::invalid_argument, "the position is not a number", "give a finite position"));
  if (settings_.require_trust && tracker_.trust() == PositionTrust::unknown)
    return fail(error(Reason::not_trusted, "the position is unknown", "home the axis, or set its position"));
  auto position = request.position;
  // A rotary axis goes the shorter way round.
  if (settings_.scale.modulo)
    position = tracker_.position() + std::remainder(position - tracker_.position(), *settings_.scale.modulo);
  auto plan = plan_move(tracker_.plan_absolute(position), request.with);
  if (!plan) return fail(plan.error());
  plan->trusted = settings_.require_trust;
  const auto activity = begin(request, options, AxisState::discrete_motion, *plan);
  launch(run_move(activity), "move");
  return activity->command;
}

Result<CommandPtr> Axis::accept(const MoveRelativeRequest& request, const CommandOptions& options) {
  if (auto allowed = check_motion(options); !allowed) return fail(allowed.error());
  if (!std::isfinite(request.distance))
    return fail(error(Reason::invalid_argument, "the distance is not a number", "give a finite distance"));
  if ((activity_ && activity_->state != AxisState::standstill) || stopping_.running || sample_->moving)
    return fail(error(Reason::moving, "a relative move needs standstill: its base would be uncertain",
                      "wait for standstill, or move to an absolute position"));
  const bool limited = settings_.limits.position_minimum.has_value();
  if (limited && tracker_.trust() == PositionTrust::unknown &&
      std::abs(request.distance) > settings_.jog_travel)
    return fail(
        Error{.reason = Reason::not_trusted,
              .message = fmt::format("{}: the position is unknown, so limits cannot be kept", settings_.name),
              .remedy = "home the axis first; shorter moves are bounded by jog_travel",
              .where = {.bus = settings_.bus, .node = settings_.node},
              .permitted = Range{.minimum = -settings_.jog_travel,
                                 .maximum = settings_.jog_travel,
                                 .unit = settings_.scale.unit}});
  const auto target = tracker_.plan_relative(request.distance);
  auto plan = plan_move(target, request.with);
  if (!plan) return fail(plan.error());
  plan->granted.distance = *plan->granted.position - tracker_.position();
  const auto activity = begin(request, options, AxisState::discrete_motion, *plan);
  launch(run_move(activity), "move");
  return activity->command;
}

/// M16: nothing on these drives notices a dead daemon or cable, so a motion without end gets one where it
/// can: the software limit of an axis that knows its position, `jog_travel` for one that does not.
Result<Plan> Axis::plan_velocity(double velocity, const MotionValues& with, bool jog) {
  auto profile = planner_.profile(velocity, with);
  if (!profile) return profile;
  profile->positive = velocity > 0;
  profile->granted.velocity = std::copysign(*profile->granted.velocity, velocity);
  if (auto direction = check_direction(profile->positive); !direction) return fail(direction.error());
  const auto& limits = settings_.limits;
  if (!limits.position_minimum) {
    profile->endless = true;
    if (profile->positive == settings_.scale.invert) profile->velocity_rpm = -profile->velocity_rpm;
    return profile;
  }
  const auto velocity_granted = profile->granted.velocity;
  PositionTracker::Target target{};
  if (tracker_.trust() != PositionTrust::unknown) {
    target = tracker_.plan_absolute(profile->positive ? *limits.position_maximum : *limits.position_minimum);
    const auto way = target.position - tracker_.position();
    if (profile->positive ? way <= 0 : way >= 0)
      return fail(Error{.reason = Reason::soft_limit,
                        .message = fmt::format("{}: at the software limit already", settings_.name),
                        .remedy = "move the other way",
                        .permitted = Range{.minimum = *limits.position_minimum,
                                           .maximum = *limits.position_maximum,
                                           .unit = settings_.scale.unit}});
  } else if (jog && settings_.jog_travel > 0) {
    target = tracker_.plan_relative(profile->positive ? settings_.jog_travel : -settings_.jog_travel);
  } else {
    return fail(error(Reason::not_trusted, "the position is unknown, so limits cannot be kept",
                      jog ? "configure jog_travel to jog an axis that is not homed" : "home the axis first"));
  }
  // The limit may be further away than the drive takes as a target: then the motion ends before it.
  const auto way = static_cast<double>(target.counter - tracker_.counter());
  if (const auto longest = static_cast<double>(planner_.longest_move()); std::abs(way) > longest)
    target = tracker_.plan_absolute(tracker_.position() + (target.position - tracker_.position()) *
                                                              (longest / std::abs(way)) * 0.999);
  auto plan = planner_.move(*profile, target, tracker_);
  if (plan) plan->granted.velocity = velocity_granted;
  if (plan) plan->trusted = tracker_.trust() != PositionTrust::unknown;
  return plan;
}

/// A repeated call with the same velocity extends the held motion that it started.
bool Axis::renewed(const Action& action, const CommandOptions& options, Duration hold) {
  if (!activity_ || !activity_->hold_until || !current(*activity_)) return false;
  const auto& known = activity_->command->value();
  const auto velocity = std::visit(
      [](const auto& request) -> std::optional<double> {
        if constexpr (requires { request.velocity; }) return request.velocity;
        return std::nullopt;
      },
      action);
  if (known.kind != kind_of(action) || known.asked.velocity != velocity ||
      activity_->options.client != options.client || activity_->options.lease_token != options.lease_token)
    return false;
  activity_->hold_until = env_.clock->now() + hold;
  // Should this very call be repeated later, it belongs to this command, too, and starts nothing.
  env_.book->attach(activity_->command, settings_.name, action, options);
  return true;
}

Result<CommandPtr> Axis::accept(const MoveVelocityRequest& request, const CommandOptions& options) {
  if (auto allowed = check_motion(options); !allowed) return fail(allowed.error());
  if (request.hold && renewed(request, options, *request.hold)) return activity_->command;
  auto plan = plan_velocity(request.velocity, request.with, false);
  if (!plan) return fail(plan.error());
  plan->granted.hold = request.hold;
  const auto activity = begin(request, options, AxisState::continuous_motion, *plan);
  if (request.hold) activity->hold_until = env_.clock->now() + *request.hold;
  launch(run_velocity(activity), "velocity");
  return activity->command;
}

Result<CommandPtr> Axis::accept(const JogRequest& request, const CommandOptions& options) {
  if (auto allowed = check_motion(options); !allowed) return fail(allowed.error());
  if (renewed(request, options, request.hold)) return activity_->command;
  auto plan = plan_velocity(request.velocity, request.with, true);
  if (!plan) return fail(plan.error());
  plan->granted.hold = request.hold;
  const auto activity = begin(request, options, AxisState::continuous_motion, *plan);
  activity->hold_until = env_.clock->now() + request.hold;
  launch(run_velocity(activity), "jog");
  return activity->command;
}

Result<CommandPtr> Axis::accept(const StopRequest& request, const CommandOptions& options) {
  auto command = env_.book->open(settings_.name, request, options);
  if (activity_) stopping_.shown = activity_->state;
  supersede(error(Reason::superseded,
                  fmt::format("{} {} by {}", to_string(command->value().kind), command->value().id,
                              options.client.empty() ? "the daemon" : options.client)));
  // The drive keeps the deceleration that was set before the motion: the answer says which (M12).
  if (request.kind != StopKind::quick_stop) command->grant({.deceleration_time = deceleration_bound()});
  if (options.arrived != TimePoint{}) observed_.stop_requested(options.arrived, request.all);
  begin_stop(request.kind, request.hold, command);
  publish();
  return command;
}

Result<CommandPtr> Axis::accept(const ResetRequest& request, const CommandOptions& options) {
  if (auto common = check_common(options); !common) return fail(common.error());
  if (auto online = check_online(); !online) return fail(online.error());
  if (auto free = check_maintenance(); !free) return fail(free.error());
  if (stopping_.running) return fail(error(Reason::stopping, "the axis is stopping", "wait for standstill"));
  if (activity_) return fail(error(Reason::busy, "another command is being executed", "wait for it"));
  if (sample_ && sample_->alarm_code != 0) {
    // All others may have lost their cause and wait for this: the drive says whether they have.
    const auto* spec = find_alarm(*descriptor_, sample_->alarm_code);
    if (spec != nullptr && spec->reset == AlarmReset::power_cycle)
      return fail(alarm_error(sample_->alarm_code, "only a power cycle ends"));
  }
  const auto activity = begin(request, options, AxisState::standstill, {});
  launch(run_reset(activity), "reset");
  return activity->command;
}

Result<CommandPtr> Axis::accept(const SetPositionRequest& request, const CommandOptions& options) {
  if (auto allowed = check_ready(options); !allowed) return fail(allowed.error());
  if (activity_ || stopping_.running || sample_->moving)
    return fail(error(Reason::moving, "the position can only be set at standstill", "wait for standstill"));
  if (absolute_segments_ && tracker_.offset_for(request.position) != home_offset())
    return fail(error(Reason::not_supported,
                      "the drive's absolute segments count from home: another position would not move them",
                      "home the axis instead"));
  // A released open-loop motor can be turned by hand: its position would be lost again at once (M20).
  if (!sample_->enabled && !drive_->closed_loop())
    return fail(error(Reason::disabled, "the power stage is off, so the position would not hold",
                      "enable the axis first"));
  if (!scale_.checked_pulses(request.position))
    return fail(
        error(Reason::invalid_argument, "the position is not a usable number", "give a finite position"));
  const auto activity = begin(request, options, AxisState::standstill, {});
  launch(run_set_position(activity), "set position");
  return activity->command;
}

Result<CommandPtr> Axis::release_stop() {
  if (!stopping_.hold)
    return fail(error(Reason::invalid_argument, "no stop is held", "nothing needs to be released"));
  stopping_.hold = false;
  publish();
  return stopping_.last;
}

Result<CommandPtr> Axis::cancel(const CommandPtr& command) {
  if (activity_ && activity_->command == command) {
    if (activity_->state != AxisState::standstill) stopping_.shown = activity_->state;
    supersede(error(Reason::cancelled, "cancelled by a client"));
    begin_stop(StopKind::halt, false, nullptr);
    publish();
  }
  return command;
}

}  // namespace axisd
