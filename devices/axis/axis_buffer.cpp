// BufferMode Buffered (PLCopen part 1): what waits for the command before it, and starts when that is done.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "devices/axis/axis.hpp"

namespace axisd {

namespace {

bool can_wait(CommandKind kind) {
  return kind == CommandKind::home || kind == CommandKind::move_absolute ||
         kind == CommandKind::move_relative || kind == CommandKind::move_velocity;
}

}  // namespace

/// Where the axis will stand when everything that is accepted is done; nothing: that has no end of its own,
/// or moves nothing.
std::optional<PositionTracker> Axis::expected_end() const {
  if (!buffer_.empty()) {
    if (kind_of(buffer_.last().action) == CommandKind::move_velocity) return std::nullopt;
    return buffer_.last().end;
  }
  const auto& plan = activity_->plan;
  switch (activity_->command->value().kind) {
    case CommandKind::enable:
      return shaft_.tracker();
    case CommandKind::home: {
      auto end = shaft_.tracker();
      end.set_position(context_.settings.homing->position, PositionTrust::homed);
      return end;
    }
    case CommandKind::move_absolute:
    case CommandKind::move_relative:
      return shaft_.tracker().after(*plan.target);
    default:
      return std::nullopt;
  }
}

/// What it will be, as far as can be told before its turn. Errors: those of a command that starts at once,
/// from there.
Result<Plan> Axis::plan_behind(const Action& action, const PositionTracker& from) const {
  const auto plan_to = [&](const PositionTracker::Target& target, const MotionValues& with) -> Result<Plan> {
    auto profile = context_.planner.profile(context_.velocity_of(with), with);
    if (!profile) return profile;
    return context_.planner.move(*std::move(profile), target, from);
  };
  if (const auto* request = std::get_if<MoveAbsoluteRequest>(&action)) {
    if (!std::isfinite(request->position))
      return fail(
          context_.error(Reason::invalid_argument, "the position is not a number", "give a finite position"));
    if (context_.settings.require_trust && from.trust() == PositionTrust::unknown)
      return fail(context_.not_trusted("the position is unknown"));
    return plan_to(context_.target_of(*request, from), request->with);
  }
  if (const auto* request = std::get_if<MoveRelativeRequest>(&action)) {
    if (!std::isfinite(request->distance))
      return fail(
          context_.error(Reason::invalid_argument, "the distance is not a number", "give a finite distance"));
    return plan_to(from.plan_relative(request->distance), request->with);
  }
  if (const auto* request = std::get_if<MoveVelocityRequest>(&action)) {
    if (request->hold)
      return fail(context_.error(Reason::not_supported, "a hold begins at once, so it cannot wait",
                                 "leave out hold"));
    if (auto possible = context_.check_velocity_mode(); !possible) return fail(possible.error());
    auto plan = context_.planner.profile(request->velocity, request->with);
    if (plan) plan->granted.velocity = std::copysign(*plan->granted.velocity, request->velocity);
    return plan;
  }
  if (!context_.settings.homing)
    return fail(context_.error(Reason::not_supported, "no homing is configured",
                               "add homing: to the axis in the YAML"));
  const auto& homing = *context_.settings.homing;
  Plan plan;
  plan.granted.velocity = homing.velocity;
  plan.granted.search_velocity = homing.search_velocity;
  plan.granted.acceleration_time = homing.acceleration_time;
  return plan;
}

/// Whatever it asked for itself: what waits for the power is looked at like what waits by its own wish.
void Axis::look_at_buffered(const Action& action, CommandOptions options, Obstacles& found) const {
  options.buffer_mode = BufferMode::buffered;
  if (!can_wait(kind_of(action)))
    return found.block(context_.error(Reason::not_supported,
                                      fmt::format("{} cannot be buffered", to_string(kind_of(action))),
                                      "send it with the buffer mode aborting"));
  if (!activity_) return std::visit([&](const auto& request) { look_at(request, options, found); }, action);
  look_at_motion(options, found);
  const auto& before = buffer_.empty() ? activity_->command->value() : buffer_.last().command->value();
  const auto from = expected_end();
  if (!from)
    found.block(context_.error(Reason::busy,
                               fmt::format("nothing can wait for {} {}", to_string(before.kind), before.id),
                               "wait for its end, or send this with the buffer mode aborting"));
  if (buffer_.full())
    found.block(context_.error(Reason::busy, fmt::format("{} commands wait already", buffer_.size()),
                               "send it when some of them are done"));
  if (from) found.block_on(plan_behind(action, *from));
}

/// What can be decided now is decided now; the rest in its turn.
Result<CommandPtr> Axis::accept_buffered(const Action& action, const CommandOptions& options) {
  Obstacles found;
  look_at_buffered(action, options, found);
  if (auto permitted = found.verdict(); !permitted) return fail(permitted.error());
  if (!activity_) return std::visit([&](const auto& request) { return accept(request, options); }, action);
  const auto from = expected_end();
  if (!from) return fail(context_.error(Reason::internal, "there is nothing to wait for"));
  auto plan = plan_behind(action, *from);
  if (!plan) return fail(plan.error());
  auto end = *from;
  if (plan->target) end = from->after(*plan->target);
  if (kind_of(action) == CommandKind::home)
    end.set_position(context_.settings.homing->position, PositionTrust::homed);
  auto command = context_.env.book->open(context_.settings.name, action, options);
  command->grant(plan->granted);
  buffer_.push({.command = command, .action = action, .options = options, .end = end});
  return command;
}

/// What waits next becomes what is executed, if nothing forbids it by now: then it ends, and all behind it.
void Axis::start_next() {
  if (buffer_.empty() || activity_) return;
  const auto next = buffer_.take_next();
  // Before anything is looked at: a stop that comes meanwhile makes it old.
  accept_epoch_ = context_.gate->epoch();
  const auto begun =
      std::visit([&](const auto& request) { return accept(request, next.options); }, next.action);
  buffer_.end_start();
  if (begun) return;
  const auto& cause = begun.error();
  const bool overtaken = cause.reason == Reason::expired || cause.reason == Reason::lease_lost ||
                         cause.reason == Reason::lease_required || cause.reason == Reason::stopping ||
                         cause.reason == Reason::inhibited || cause.reason == Reason::state_unaccepted;
  overtaken ? next.command->abort(cause) : next.command->error(cause);
  drop_buffer(cause);
}

/// What was planned from where the command before it ends has no base without it.
void Axis::drop_buffer(const Error& cause) { end_waiting(buffer_.take_all(), cause); }

void Axis::end_waiting(const std::deque<Buffered>& commands, const Error& cause) {
  for (const auto& waiting : commands) {
    auto told = context_.error(Reason::superseded, "what it waited for was not done: " + cause.message,
                               "send it again, if it is still wanted");
    if (cause.reason == Reason::lease_lost) told.reason = cause.reason;
    told.outcome = Outcome::not_sent;
    waiting.command->abort(std::move(told));
  }
}

/// Ends one that waits, and those behind it. False: it does not wait.
bool Axis::cancel_buffered(const CommandPtr& command) {
  auto leaving = buffer_.cut(command);
  if (leaving.empty()) return false;
  auto cause = context_.error(Reason::cancelled, "cancelled by a client");
  cause.outcome = Outcome::not_sent;
  command->abort(cause);
  leaving.pop_front();
  end_waiting(leaving, cause);
  return true;
}

}  // namespace axisd
