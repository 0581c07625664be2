// Acceptance: what is permitted (Preconditions) becomes a command, before the wire is touched.
#include "devices/axis/acceptance.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "devices/axis/execution.hpp"
#include "devices/axis/homing_sequence.hpp"
#include "devices/axis/motion_sequence.hpp"
#include "devices/axis/power_sequence.hpp"
#include "devices/axis/power_wait.hpp"
#include "devices/axis/preconditions.hpp"
#include "devices/axis/publisher.hpp"
#include "devices/axis/sequences.hpp"
#include "devices/axis/start_wait.hpp"
#include "devices/axis/stopper.hpp"

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

Result<CommandPtr> Acceptance::submit(const Action& action, const CommandOptions& options) {
  execution_.accept_now();
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
  const bool for_power = execution_.buffer().empty() && waits_for_power(execution_.activity(), action);
  if (options.buffer_mode == BufferMode::buffered || for_power) return accept_buffered(action, options);
  return std::visit([&](const auto& request) { return accept(request, options); }, action);
}

/// The hold counts from when its call arrived: whoever let go since then is not kept moving.
TimePoint Acceptance::held_until(const CommandOptions& options, Duration hold) const {
  const auto now = context_.env.clock->now();
  return (options.arrived == TimePoint{} ? now : std::min(now, options.arrived)) + hold;
}

/// A repeated jog (or held velocity) extends the motion that it started, and never starts one that has ended.
void Acceptance::renew_hold(const CommandPtr& command, const CommandOptions& options) {
  if (!execution_.holds() || execution_.activity()->command != command) return;
  const auto until = held_until(options, command->value().asked.hold.value_or(Duration{0}));
  execution_.activity()->hold_until = std::max(*execution_.activity()->hold_until, until);
}

template <class Request>
Result<void> Acceptance::permit(const Request& request, const CommandOptions& options) const {
  Obstacles found;
  preconditions_.look_at(request, options, found);
  return found.verdict();
}

ActivityPtr Acceptance::begin(const Action& action, const CommandOptions& options, AxisState state,
                              Plan plan) {
  const bool waited = execution_.buffer().starts();
  auto command = waited ? execution_.buffer().take_starting()
                        : context_.env.book->open(context_.settings.name, action, options);
  const auto replaced = execution_.activity();
  const bool moving =
      (replaced && replaced->state != AxisState::standstill) || (shaft_.sample() && shaft_.sample()->moving);
  execution_.note_motion_to_stop();
  if (replaced)
    execution_.supersede(
        context_.error(Reason::superseded,
                       fmt::format("replaced by {} {}", to_string(kind_of(action)), command->value().id)));
  // M9: what a start in motion does is not in the manuals, so the motion is ended first.
  if (moving && !stop_.under_way()) stopper_.begin_stop(StopKind::halt, nullptr);
  command->grant(plan.granted);
  const auto activity = std::make_shared<Activity>(Activity{.command = std::move(command),
                                                            .state = state,
                                                            .epoch = execution_.accept_epoch(),
                                                            .options = options,
                                                            .plan = std::move(plan)});
  execution_.begin(activity);
  const bool by_own_wish = waited && options.buffer_mode == BufferMode::buffered;
  starts_.bound_start(activity, by_own_wish, moving || stop_.under_way());
  // A group has one for all its members.
  auto* turns = context_.env.bus->start_turns();
  if (turns != nullptr && state != AxisState::standstill && state != AxisState::synchronized_motion)
    activity->turn = turns->announce();
  publisher_.publish();
  return activity;
}

Result<CommandPtr> Acceptance::accept(const EnableRequest& request, const CommandOptions& options) {
  if (auto permitted = permit(request, options); !permitted) return fail(permitted.error());
  context_.env.bus->about_to_energise();
  const auto activity = begin(request, options, AxisState::standstill, {});
  // Not yet enabled: state() follows the drive's own bit.
  sequences_.launch(power_sequence_.run_enable(activity), "enable");
  return activity->command;
}

Result<CommandPtr> Acceptance::accept(const DisableRequest& request, const CommandOptions& options) {
  if (auto permitted = permit(request, options); !permitted) return fail(permitted.error());
  execution_.supersede(context_.error(Reason::superseded, "the axis is being disabled"));
  stopper_.begin_stop(StopKind::stop, nullptr);
  const auto activity = begin(request, options, AxisState::standstill, {});
  sequences_.launch(power_sequence_.run_disable(activity), "disable");
  return activity->command;
}

void Acceptance::release(const CommandOptions& options) {
  execution_.accept_now();
  (void)accept(DisableRequest{}, options);
}

Result<CommandPtr> Acceptance::accept(const HomeRequest& request, const CommandOptions& options) {
  if (auto permitted = permit(request, options); !permitted) return fail(permitted.error());
  Plan plan;
  plan.granted.velocity = context_.settings.homing->velocity;
  plan.granted.search_velocity = context_.settings.homing->search_velocity;
  plan.granted.acceleration_time = context_.settings.homing->acceleration_time;
  plan.deceleration_time = context_.planner.braking_time(context_.settings.homing->velocity,
                                                         context_.settings.homing->acceleration_time);
  const auto activity = begin(request, options, AxisState::homing, std::move(plan));
  sequences_.launch(homing_.run_home(activity), "home");
  return activity->command;
}

Result<CommandPtr> Acceptance::accept(const MoveAbsoluteRequest& request, const CommandOptions& options) {
  if (auto permitted = permit(request, options); !permitted) return fail(permitted.error());
  auto plan = preconditions_.plans().plan_move(context_.target_of(request, shaft_.tracker()), request.with);
  if (!plan) return fail(plan.error());
  plan->trusted = context_.settings.require_trust;
  const auto activity = begin(request, options, AxisState::discrete_motion, *plan);
  sequences_.launch(motion_.run_move(activity), "move");
  return activity->command;
}

Result<CommandPtr> Acceptance::accept(const MoveRelativeRequest& request, const CommandOptions& options) {
  if (auto permitted = permit(request, options); !permitted) return fail(permitted.error());
  auto plan =
      preconditions_.plans().plan_move(shaft_.tracker().plan_relative(request.distance), request.with);
  if (!plan) return fail(plan.error());
  const auto activity = begin(request, options, AxisState::discrete_motion, *plan);
  sequences_.launch(motion_.run_move(activity), "move");
  return activity->command;
}

CommandPtr Acceptance::renew(const Action& action, const CommandOptions& options, Duration hold) {
  // Should this very call be repeated later, also after a crash, it belongs to this command, too, and starts
  // nothing: it counts once that is known.
  context_.env.book->attach(execution_.activity()->command, context_.settings.name, action, options,
                            [activity = std::weak_ptr(execution_.activity()),
                             until = held_until(options, hold)](const Result<void>& known) {
                              if (const auto held = activity.lock(); held && known)
                                held->hold_until = std::max(held->hold_until.value_or(until), until);
                            });
  return execution_.activity()->command;
}

Result<CommandPtr> Acceptance::accept(const MoveVelocityRequest& request, const CommandOptions& options) {
  if (auto permitted = permit(request, options); !permitted) return fail(permitted.error());
  if (request.hold && preconditions_.renews(request, options)) return renew(request, options, *request.hold);
  auto plan = preconditions_.plans().plan_velocity(request.velocity, request.with, false);
  if (!plan) return fail(plan.error());
  plan->granted.hold = request.hold;
  const auto activity = begin(request, options, AxisState::continuous_motion, *plan);
  if (request.hold) activity->hold_until = held_until(options, *request.hold);
  sequences_.launch(motion_.run_velocity(activity), "velocity");
  return activity->command;
}

Result<CommandPtr> Acceptance::accept(const JogRequest& request, const CommandOptions& options) {
  if (auto permitted = permit(request, options); !permitted) return fail(permitted.error());
  if (preconditions_.renews(request, options)) return renew(request, options, request.hold);
  auto plan = preconditions_.plans().plan_velocity(request.velocity, request.with, true);
  if (!plan) return fail(plan.error());
  plan->granted.hold = request.hold;
  const auto activity = begin(request, options, AxisState::continuous_motion, *plan);
  activity->hold_until = held_until(options, request.hold);
  sequences_.launch(motion_.run_velocity(activity), "jog");
  return activity->command;
}

Result<CommandPtr> Acceptance::accept(const StopRequest& request, const CommandOptions& options) {
  auto command = context_.env.book->open(context_.settings.name, request, options);
  execute_stop(request, options, command);
  return command;
}

void Acceptance::execute_stop(const StopRequest& request, const CommandOptions& options, CommandPtr command) {
  execution_.note_motion_to_stop();
  execution_.supersede(context_.error(
      Reason::superseded, fmt::format("{} {} by {}", to_string(command->value().kind), command->value().id,
                                      options.client.empty() ? "the daemon" : options.client)));
  // The drive keeps the deceleration that was set before the motion: the answer says which (M12).
  if (const auto braking = stopper_.braking_time(request.kind);
      request.kind != StopKind::quick_stop || braking > Duration{})
    command->grant({.deceleration_time = braking});
  if (options.arrived != TimePoint{}) stopper_.observed().stop_requested(options.arrived, request.all);
  stopper_.begin_stop(request.kind, std::move(command));
  publisher_.publish();
}

Result<CommandPtr> Acceptance::accept(const ResetRequest& request, const CommandOptions& options) {
  if (auto permitted = permit(request, options); !permitted) return fail(permitted.error());
  const auto activity = begin(request, options, AxisState::standstill, {});
  sequences_.launch(power_sequence_.run_reset(activity), "reset");
  return activity->command;
}

Result<CommandPtr> Acceptance::accept(const SetPositionRequest& request, const CommandOptions& options) {
  if (auto permitted = permit(request, options); !permitted) return fail(permitted.error());
  const auto activity = begin(request, options, AxisState::standstill, {});
  sequences_.launch(power_sequence_.run_set_position(activity), "set position");
  return activity->command;
}

Result<CommandPtr> Acceptance::cancel(const CommandPtr& command, TimePoint arrived) {
  if (execution_.cancel_buffered(command)) {
    publisher_.publish();
  } else if (execution_.activity() && execution_.activity()->command == command) {
    stop_.arrived(arrived);
    execution_.note_motion_to_stop();
    execution_.supersede(context_.error(Reason::cancelled, "cancelled by a client"));
    stopper_.begin_stop(StopKind::halt, nullptr);
    publisher_.publish();
  }
  return command;
}

/// What can be decided now is decided now; the rest in its turn.
Result<CommandPtr> Acceptance::accept_buffered(const Action& action, const CommandOptions& options) {
  Obstacles found;
  preconditions_.look_at_buffered(action, options, found);
  if (auto permitted = found.verdict(); !permitted) return fail(permitted.error());
  if (!execution_.activity())
    return std::visit([&](const auto& request) { return accept(request, options); }, action);
  const auto from = preconditions_.plans().expected_end();
  if (!from) return fail(context_.error(Reason::internal, "there is nothing to wait for"));
  auto plan = preconditions_.plans().plan_behind(action, *from);
  if (!plan) return fail(plan.error());
  auto end = *from;
  if (plan->target) end = from->after(*plan->target);
  if (kind_of(action) == CommandKind::home)
    end.set_position(context_.settings.homing->position, PositionTrust::homed);
  auto command = context_.env.book->open(context_.settings.name, action, options);
  command->grant(plan->granted);
  execution_.buffer().push({.command = command, .action = action, .options = options, .end = end});
  return command;
}

/// What waits next becomes what is executed, if nothing forbids it by now: then it ends, and all behind it.
void Acceptance::start_next() {
  if (execution_.buffer().empty() || execution_.activity()) return;
  const auto next = execution_.buffer().take_next();
  // Before anything is looked at: a stop that comes meanwhile makes it old.
  execution_.accept_now();
  const auto begun =
      std::visit([&](const auto& request) { return accept(request, next.options); }, next.action);
  execution_.buffer().end_start();
  if (begun) return;
  const auto& cause = begun.error();
  const bool overtaken = cause.reason == Reason::expired || cause.reason == Reason::lease_lost ||
                         cause.reason == Reason::lease_required || cause.reason == Reason::stopping ||
                         cause.reason == Reason::inhibited || cause.reason == Reason::state_unaccepted;
  overtaken ? next.command->abort(cause) : next.command->error(cause);
  execution_.drop_buffer(cause);
}

Result<Plan> Acceptance::plan_member(const GroupMemberRequest& request, const CommandOptions& options) {
  execution_.accept_now();
  if (options.buffer_mode == BufferMode::buffered)
    return fail(context_.error(Reason::not_supported, "a group move cannot be buffered",
                               "send it when its members rest, with the buffer mode aborting"));
  Obstacles found;
  preconditions_.look_at(request, options, found);
  if (auto permitted = found.verdict(); !permitted) return fail(permitted.error());
  const auto target =
      request.position
          ? context_.target_of(MoveAbsoluteRequest{.position = *request.position}, shaft_.tracker())
          : shaft_.tracker().plan_relative(request.distance.value_or(0));
  auto plan = preconditions_.plans().plan_move(target, request.with);
  if (!plan) return plan;
  if (request.position) plan->trusted = context_.settings.require_trust;
  return plan;
}

Result<CommandPtr> Acceptance::accept(const GroupMemberRequest&, const CommandOptions&) const {
  return fail(
      context_.error(Reason::not_supported, "this is a part of a group move", "send it with MoveGroup"));
}

void Acceptance::take_stop(const StopRequest& request, const CommandOptions& options, CommandPtr command) {
  execution_.accept_now();
  context_.gate->stop_served();
  execute_stop(request, options, std::move(command));
}

}  // namespace axisd
