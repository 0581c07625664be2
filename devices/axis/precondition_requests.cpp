// What each request needs, in the order of refusals.
#include <fmt/format.h>

#include <cmath>
#include <string>
#include <utility>

#include "devices/axis/drift_check.hpp"
#include "devices/axis/drive_work.hpp"
#include "devices/axis/execution.hpp"
#include "devices/axis/preconditions.hpp"
#include "devices/axis/start_wait.hpp"

namespace axisd {

namespace {

bool can_wait(CommandKind kind) {
  return kind == CommandKind::home || kind == CommandKind::move_absolute ||
         kind == CommandKind::move_relative || kind == CommandKind::move_velocity;
}

}  // namespace

void Preconditions::look_at(const EnableRequest& /*request*/, const CommandOptions& options,
                            Obstacles& found) const {
  look_at_readiness(options, found);
  // A drive that turns while it is being enabled was moved by that, as far as can be told.
  if (!execution_.at_rest())
    found.block(context_.error(Reason::moving, "the axis moves", "wait for standstill"));
  if (execution_.activity() && execution_.activity()->state == AxisState::standstill)
    found.block(context_.error(Reason::busy, "another command is being executed", "wait for it"));
  static constexpr std::string_view releasing[] = {"motor_free"};
  look_at_holding_terminals(releasing, found);
}

/// Also while the drive is not configured: some of its configuration is only written while it is released.
void Preconditions::look_at(const DisableRequest& /*request*/, const CommandOptions& /*options*/,
                            Obstacles& found) const {
  if (link_.offline()) look_at_link(found);
}

void Preconditions::look_at(const HomeRequest& /*request*/, const CommandOptions& options,
                            Obstacles& found) const {
  look_at_motion(options, found);
  if (!context_.settings.homing) {
    found.block(context_.error(Reason::not_supported, "no homing is configured",
                               "add homing: to the axis in the YAML"));
  } else if (shaft_.on_homing_switch() && !context_.settings.homing->backoff) {
    found.block(context_.error(Reason::limit_switch,
                               fmt::format("the {} switch is already active", context_.homing_switch()),
                               "move away from it, or configure homing: { backoff: ... }"));
  }
  look_at_present_motion(found);
  look_at_line(found);
}

void Preconditions::look_at(const MoveAbsoluteRequest& request, const CommandOptions& options,
                            Obstacles& found) const {
  look_at_motion(options, found);
  const bool number = std::isfinite(request.position);
  if (!number)
    found.block(
        context_.error(Reason::invalid_argument, "the position is not a number", "give a finite position"));
  const bool lost = context_.settings.require_trust && shaft_.tracker().trust() == PositionTrust::unknown;
  if (lost) found.block(context_.not_trusted("the position is unknown"));
  context_.planner.check_profile(context_.velocity_of(request.with), request.with, found);
  if (number && !lost) look_at_target(context_.target_of(request, shaft_.tracker()), found);
  look_at_present_motion(found);
  look_at_line(found);
}

void Preconditions::look_at(const MoveRelativeRequest& request, const CommandOptions& options,
                            Obstacles& found) const {
  look_at_motion(options, found);
  const bool number = std::isfinite(request.distance);
  if (!number)
    found.block(
        context_.error(Reason::invalid_argument, "the distance is not a number", "give a finite distance"));
  if ((execution_.activity() && execution_.activity()->state != AxisState::standstill) || stop_.under_way() ||
      (shaft_.sample() && shaft_.sample()->moving))
    found.block(context_.error(Reason::moving,
                               "a relative move needs standstill: its base would be uncertain",
                               "wait for standstill, or move to an absolute position"));
  const bool limited = context_.settings.limits.position_minimum.has_value();
  if (number && limited && shaft_.tracker().trust() == PositionTrust::unknown &&
      std::abs(request.distance) > context_.settings.jog_travel) {
    auto lost = context_.not_trusted("the position is unknown, so limits cannot be kept");
    lost.remedy += "; shorter moves are bounded by jog_travel";
    lost.permitted = Range{.minimum = -context_.settings.jog_travel,
                           .maximum = context_.settings.jog_travel,
                           .unit = context_.settings.scale.unit};
    found.block(std::move(lost));
  }
  context_.planner.check_profile(context_.velocity_of(request.with), request.with, found);
  if (number) look_at_target(shaft_.tracker().plan_relative(request.distance), found);
  look_at_line(found);
}

void Preconditions::look_at(const MoveVelocityRequest& request, const CommandOptions& options,
                            Obstacles& found) const {
  look_at_motion(options, found);
  if (request.hold && renews(request, options)) return;
  look_at_velocity(request.velocity, request.with, false, found);
  look_at_present_motion(found);
  look_at_line(found);
}

void Preconditions::look_at(const JogRequest& request, const CommandOptions& options,
                            Obstacles& found) const {
  look_at_motion(options, found);
  if (renews(request, options)) return;
  look_at_velocity(request.velocity, request.with, true, found);
  look_at_present_motion(found);
  look_at_line(found);
}

void Preconditions::look_at(const ResetRequest& /*request*/, const CommandOptions& options,
                            Obstacles& found) const {
  look_at_options(options, found);
  look_at_link(found);
  look_at_maintenance(found);
  if (stop_.under_way())
    found.block(context_.error(Reason::stopping, "the axis is stopping", "wait for standstill"));
  if (execution_.activity())
    found.block(context_.error(Reason::busy, "another command is being executed", "wait for it"));
  if (!shaft_.sample() || shaft_.sample()->alarm_code == 0) return;
  // All others may have lost their cause and wait for this: the drive says whether they have.
  const auto* spec = find_alarm(*context_.descriptor, shaft_.sample()->alarm_code);
  if (spec != nullptr && spec->reset == AlarmReset::power_cycle)
    found.block(context_.alarm_error(shaft_.sample()->alarm_code, "only a power cycle ends"));
}

void Preconditions::look_at(const SetPositionRequest& request, const CommandOptions& options,
                            Obstacles& found) const {
  look_at_readiness(options, found);
  if (execution_.activity() || stop_.under_way() || (shaft_.sample() && shaft_.sample()->moving))
    found.block(
        context_.error(Reason::moving, "the position can only be set at standstill", "wait for standstill"));
  const bool number = context_.scale.checked_pulses(request.position).has_value();
  if (number && work_.absolute_segments() &&
      !context_.is_from_home(shaft_.tracker().offset_for(request.position)))
    found.block(
        context_.error(Reason::not_supported,
                       "the drive's absolute segments count from home: another position would not move them",
                       "home the axis instead: " + context_.shell("home")));
  // A released motor can be turned by hand: its position would be lost again at once (M20).
  if (shaft_.sample() && !shaft_.sample()->enabled && !context_.counts_while_released())
    found.block(context_.error(Reason::disabled, "the power stage is off, so the position would not hold",
                               "enable the axis first: " + context_.shell("enable")));
  if (!number)
    found.block(context_.error(Reason::invalid_argument, "the position is not a usable number",
                               "give a finite position"));
}

/// As a move of its own; and it has to rest.
void Preconditions::look_at(const GroupMemberRequest& request, const CommandOptions& options,
                            Obstacles& found) const {
  if (request.position)
    look_at(MoveAbsoluteRequest{.position = *request.position, .with = request.with}, options, found);
  else
    look_at(MoveRelativeRequest{.distance = request.distance.value_or(0), .with = request.with}, options,
            found);
  if (execution_.activity() && execution_.activity()->state == AxisState::standstill)
    found.block(context_.error(Reason::busy, "another command is being executed", "wait for it"));
  else if (execution_.activity() || stop_.under_way() || (shaft_.sample() && shaft_.sample()->moving))
    found.block(context_.error(Reason::moving, "a member of a group move has to rest",
                               "wait for standstill, or halt it"));
}

void Preconditions::look_at_velocity(double velocity, const MotionValues& with, bool jog,
                                     Obstacles& found) const {
  found.block_on(context_.check_velocity_mode());
  context_.planner.check_profile(velocity, with, found);
  if (!std::isfinite(velocity) || velocity == 0) return;
  look_at_direction(velocity > 0, found);
  const auto end = plans_.end_of_velocity(velocity > 0, jog);
  found.block_on(end);
  if (end && *end) context_.planner.check_move(**end, shaft_.tracker(), found);
}

/// Whatever it asked for itself: what waits for the power is looked at like what waits by its own wish.
void Preconditions::look_at_buffered(const Action& action, CommandOptions options, Obstacles& found) const {
  options.buffer_mode = BufferMode::buffered;
  if (!can_wait(kind_of(action)))
    return found.block(context_.error(Reason::not_supported,
                                      fmt::format("{} cannot be buffered", to_string(kind_of(action))),
                                      "send it with the buffer mode aborting"));
  if (!execution_.activity())
    return std::visit([&](const auto& request) { look_at(request, options, found); }, action);
  look_at_motion(options, found);
  const auto& before = execution_.buffer().empty() ? execution_.activity()->command->value()
                                                   : execution_.buffer().last().command->value();
  const auto from = plans_.expected_end();
  if (!from)
    found.block(context_.error(Reason::busy,
                               fmt::format("nothing can wait for {} {}", to_string(before.kind), before.id),
                               "wait for its end, or send this with the buffer mode aborting"));
  if (execution_.buffer().full())
    found.block(context_.error(Reason::busy,
                               fmt::format("{} commands wait already", execution_.buffer().size()),
                               "send it when some of them are done"));
  if (from) found.block_on(plans_.plan_behind(action, *from));
}

/// A repeated call with the same velocity extends the held motion that it started.
bool Preconditions::renews(const Action& action, const CommandOptions& options) const {
  if (!execution_.holds()) return false;
  const auto& known = execution_.activity()->command->value();
  const auto velocity = std::visit(
      [](const auto& request) -> std::optional<double> {
        if constexpr (requires { request.velocity; }) return request.velocity;
        return std::nullopt;
      },
      action);
  return known.kind == kind_of(action) && known.asked.velocity == velocity &&
         execution_.activity()->options.client == options.client &&
         execution_.activity()->options.lease_token == options.lease_token;
}

}  // namespace axisd
