#include "devices/axis/motion_plans.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "devices/axis/execution.hpp"

namespace axisd {

/// Where the axis will stand when everything that is accepted is done; nothing: that has no end of its own,
/// or moves nothing.
std::optional<PositionTracker> MotionPlans::expected_end() const {
  if (!execution_.buffer().empty()) {
    if (kind_of(execution_.buffer().last().action) == CommandKind::move_velocity) return std::nullopt;
    return execution_.buffer().last().end;
  }
  const auto& plan = execution_.activity()->plan;
  switch (execution_.activity()->command->value().kind) {
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
Result<Plan> MotionPlans::plan_behind(const Action& action, const PositionTracker& from) const {
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

Result<Plan> MotionPlans::plan_move(const PositionTracker::Target& target, const MotionValues& with) const {
  const auto profile = context_.planner.profile(context_.velocity_of(with), with);
  if (!profile) return fail(profile.error());
  return context_.planner.move(*profile, target, shaft_.tracker());
}

/// M16: nothing on these drives notices a dead daemon or cable, so a motion without end gets one where it
/// can: the software limit of an axis that knows its position, `jog_travel` for one that does not.
Result<std::optional<PositionTracker::Target>> MotionPlans::end_of_velocity(bool positive, bool jog) const {
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

Result<Plan> MotionPlans::plan_velocity(double velocity, const MotionValues& with, bool jog) const {
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

}  // namespace axisd
