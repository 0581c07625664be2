// A limit switch has to end a motion, forbid its direction, and permit the other one.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "api/axisctl/commission/procedure.hpp"
#include "api/axisctl/commission/record.hpp"
#include "api/axisctl/error.hpp"
#include "api/axisctl/explain_view.hpp"
#include "api/axisctl/format.hpp"

namespace axisd::axisctl::commission {
namespace {

std::string with_function(const v1::Terminal& input) {
  return fmt::format("{} ({})", input.name(), input.function());
}

bool is_active_in(const v1::AxisState& state, const std::string& terminal) {
  return std::ranges::any_of(state.inputs(),
                             [&](const auto& input) { return input.name() == terminal && input.active(); });
}

/// The limit switch that became active in place of `expected`: the axis would go on into the end of its way.
std::string limit_instead(const v1::AxisState& state, const v1::AxisState& before,
                          const std::string& expected) {
  if (is_active_in(state, expected)) return {};
  for (const auto& input : state.inputs())
    if (input.active() && is_limit(input.function()) && !is_active_in(before, input.name()))
      return with_function(input);
  return {};
}

}  // namespace

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
  EventFeed feed(axis_.client(), before);
  LimitObservation seen{.input = expected(plan), .command = {}, .further = {}, .away_left_out = {}};
  std::optional<double> active_at;
  const auto run = follow(axis_.move(distance, motion.velocity), step, [&](const v1::AxisState& state) {
    if (!active_at && is_active_in(state, plan.terminal)) active_at = state.position();
    seen.other = limit_instead(state, before, plan.terminal);
    return seen.other.empty();
  });
  seen.command = run.command;
  if (!ended(run.command)) end_by_stop(step, seen);
  const auto rest = settled();
  const auto place = unwrapped(rest.position(), run.samples.back().position(), settings_);
  for (auto& edge : feed.take()) {
    if (edge.terminal() == plan.terminal && edge.active()) seen.became_active = true;
    if (seen.other.empty()) seen.other = limit_instead(edge, plan.terminal);
    *step.add_edges() = std::move(edge);
  }
  seen.became_active = seen.became_active || active_at.has_value();
  seen.moving = rest.moving();
  add_figure(step, "travelled", place - before.position(), unit);
  if (active_at) add_figure(step, "after_edge", std::abs(place - *active_at), unit);
  add_figure(step, "velocity", seen.command.granted().velocity(), unit + "/s");
  if (auto judgement = judge_limit_end(seen); judgement.verdict != VERDICT_PASSED) return judgement;
  leave_limit(plan, step, seen);
  return judge_limit(seen);
}

void Procedure::end_by_stop(Step& step, LimitObservation& seen) {
  const auto stop = axis_.stop(false);
  seen.command = axis_.command(seen.command.id());
  seen.stopped = true;
  *step.add_commands() = seen.command;
  *step.add_commands() = stop;
  if (stop.state() != v1::COMMAND_STATE_DONE)
    throw StepEnd(VERDICT_FAILED, fmt::format("{} became active; standstill is NOT confirmed", seen.other),
                  "look at the machine");
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
