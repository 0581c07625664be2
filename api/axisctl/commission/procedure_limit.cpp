// A limit switch has to end a motion, forbid its direction, and permit the other one.
#include <fmt/format.h>

#include <cmath>

#include "api/axisctl/commission/procedure.hpp"
#include "api/axisctl/commission/record.hpp"
#include "api/axisctl/error.hpp"
#include "api/axisctl/explain_view.hpp"
#include "api/axisctl/format.hpp"

namespace axisd::axisctl::commission {

Judgement Procedure::limit(const StepPlan& plan, Step& step) {
  const auto& unit = record_.unit();
  const auto name = fmt::format("{} ({})", plan.terminal, plan.function);
  if (is_active(plan.terminal)) throw StepEnd(VERDICT_FAILED, name + " is active already", "release it");
  const auto before = axis_.state();
  const double room = bounded(motion_.velocity * 3600, plan.positive, before, settings_);
  const auto motion = limit_motion(motion_, room, velocities_);
  if (motion.distance < motion.velocity)  // no hand is so quick
    throw StepEnd(VERDICT_NOT_DONE,
                  fmt::format("it may move only {} in that direction", with_unit(room, unit)),
                  before.trust() == v1::POSITION_TRUST_UNKNOWN
                      ? fmt::format("axes.{}.jog_travel permits longer moves before homing; or home it first",
                                    axis_.name())
                      : "move it away from the software limit first");
  const double distance = plan.positive ? motion.distance : -motion.distance;
  check_move(distance, motion.velocity);
  permit(fmt::format(
             "Go to the switch at {}. {}, and has to stop by itself once the switch is actuated, by your "
             "hand or by the axis. Keep it actuated then. Enter stops it. Move?",
             name, move_text(distance, motion.velocity, before)),
         step);
  EventFeed feed(axis_.client(), axis_.name());
  LimitObservation seen{.input = expected(plan), .command = {}, .further = {}, .away_left_out = {}};
  std::optional<double> active_at;
  const auto run = follow(axis_.move(distance, motion.velocity), step, [&](const v1::AxisState& state) {
    for (const auto& input : state.inputs())
      if (input.name() == plan.terminal && input.active() && !active_at) active_at = state.position();
    return true;
  });
  const auto rest = settled();
  const auto place = unwrapped(rest.position(), run.samples.back().position(), settings_);
  for (auto& edge : feed.take()) {
    if (edge.terminal() == plan.terminal && edge.active()) seen.became_active = true;
    if (edge.terminal() != plan.terminal && edge.active() && seen.other.empty())
      seen.other = edge.function().empty() ? edge.terminal()
                                           : fmt::format("{} ({})", edge.terminal(), edge.function());
    *step.add_edges() = std::move(edge);
  }
  seen.became_active = seen.became_active || active_at.has_value();
  seen.command = run.command;
  seen.moving = rest.moving();
  add_figure(step, "travelled", place - before.position(), unit);
  if (active_at) add_figure(step, "after_edge", std::abs(place - *active_at), unit);
  add_figure(step, "velocity", seen.command.granted().velocity(), unit + "/s");
  if (auto judgement = judge_limit_end(seen); judgement.verdict != VERDICT_PASSED) return judgement;
  leave_limit(plan, step, seen);
  return judge_limit(seen);
}

void Procedure::leave_limit(const StepPlan& plan, Step& step, LimitObservation& seen) {
  person_.tell(fmt::format("{} ended the motion.", plan.terminal));
  const auto active = [&] { return is_active(plan.terminal); };
  if (!active())
    person_.tell(fmt::format("Actuate {} again, and keep it. (s: skip, a: abort)", plan.terminal));
  if (!wait_until(active, step))
    throw StepEnd(VERDICT_FAILED, fmt::format("{} was not kept actuated", plan.terminal));
  // Asked about, never sent: should the switch be released meanwhile, it would move.
  const auto before = axis_.state();
  const double sign = plan.positive ? 1 : -1;
  seen.further = axis_.explain_move(sign * motion_.distance, motion_.velocity);
  if (blocked_by(seen.further, v1::REASON_LIMIT_SWITCH) == nullptr) return;
  person_.tell("Motion further in that direction is refused.");
  const double distance = -sign * bounded(motion_.distance, !plan.positive, before, settings_);
  check_move(distance, motion_.velocity);
  const auto permission =
      dialogue_.permit(fmt::format("With {} still actuated: {}, away from it. Enter stops it. Move?",
                                   plan.terminal, move_text(distance, motion_.velocity, before)),
                       step);
  if (permission.granted)
    seen.away = follow(axis_.move(distance, motion_.velocity), step).command;
  else
    seen.away_left_out = permission.reason;
  if (!active()) return;
  person_.tell(fmt::format("Release {}. (s: skip, a: abort)", plan.terminal));
  if (!wait_until([&] { return !active(); }, step))
    throw StepEnd(VERDICT_FAILED, fmt::format("{} stayed active", plan.terminal));
}

}  // namespace axisd::axisctl::commission
