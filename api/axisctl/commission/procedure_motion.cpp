// The steps with the power stage on: power, jogs, stop, homing.
#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>

#include <cmath>

#include "api/axisctl/commission/procedure.hpp"
#include "api/axisctl/commission/record.hpp"
#include "api/axisctl/duration.hpp"
#include "api/axisctl/error.hpp"
#include "api/axisctl/format.hpp"
#include "config/models.hpp"

namespace axisd::axisctl::commission {
namespace {

using google::protobuf::util::TimeUtil;

double seconds_between(const google::protobuf::Timestamp& from, const google::protobuf::Timestamp& to) {
  return static_cast<double>(TimeUtil::DurationToNanoseconds(to - from)) / 1e9;
}

/// Positions are exact to a pulse; an encoder's may differ by its error at rest.
constexpr double share_of_distance = 0.01;

/// A stop comes when so much of the way lies behind.
constexpr double share_before_stop = 1.0 / 3;

std::string no_room(const v1::AxisState& state) {
  return state.trust() == v1::POSITION_TRUST_UNKNOWN
             ? "the position is unknown, and no jog_travel is configured"
             : "it stands at the software limit";
}

std::string room_remedy(const v1::AxisState& state) {
  return state.trust() == v1::POSITION_TRUST_UNKNOWN
             ? fmt::format("axes.{}.jog_travel permits short moves before homing", state.axis())
             : "move it away from there first";
}

}  // namespace

Judgement Procedure::enable(Step& step) {
  const auto state = axis_.state();
  if (state.enabled()) return {.verdict = VERDICT_PASSED, .reason = "it was on already", .remedy = {}};
  permit(
      "Take your hands away. The power stage is switched on now: the motor holds, and does not move. "
      "Switch it on?",
      step);
  const auto before = axis_.state();
  const auto run = follow(axis_.enable(), step);
  if (run.command.state() != v1::COMMAND_STATE_DONE)
    return {.verdict = VERDICT_FAILED,
            .reason = command_line(run.command, record_.unit()),
            .remedy = fmt::format("axisctl explain {} enable", axis_.name())};
  const auto after = axis_.state();
  add_figure(step, "moved", unwrapped(after.position(), before.position(), settings_) - before.position(),
             record_.unit());
  return {};
}

Judgement Procedure::jog(const StepPlan& plan, Step& step) {
  const auto& unit = record_.unit();
  const auto before = axis_.state();
  const double room = bounded(motion_.distance, plan.positive, before, settings_);
  if (room <= 0) throw StepEnd(VERDICT_NOT_DONE, no_room(before), room_remedy(before));
  const double distance = plan.positive ? room : -room;
  const bool proves = record_.speed() != SPEED_PROOF_PROVEN;
  const double velocity = proves ? proving_velocity(velocities_, motion_.velocity, room) : motion_.velocity;
  check_move(distance, velocity);
  const bool in_one_frame = settings_ && settings_->starts_in_one_frame;
  permit(fmt::format("{}{}.{} Look at the machine; Enter stops it. Move?",
                     move_text(distance, velocity, before), proves ? ", and its time is measured" : "",
                     in_one_frame
                         ? " It is started in one frame, of which the drive's manual says nothing: be ready "
                           "to stop it, should it go elsewhere."
                         : ""),
         step);
  const auto start = axis_.state();
  auto run = follow(axis_.move(distance, velocity), step);
  JogObservation seen{.axis = axis_.name(), .command = run.command, .distance = distance};
  const auto after = axis_.state();
  run.samples.push_back(after);
  // A rotary axis begins anew after a turn: of all places it is the one next to the target.
  seen.travelled = unwrapped(after.position(), before.position() + distance, settings_) - before.position();
  seen.tolerance = room * share_of_distance;
  seen.invert = settings_ && settings_->invert;
  seen.measured = after.position_source() == v1::POSITION_SOURCE_ENCODER;
  seen.described_by_file = config::is_described_by_file(record_.model());
  seen.in_one_frame = in_one_frame;
  add_figure(step, "asked", distance, unit);
  add_figure(step, "travelled", seen.travelled, unit);
  add_figure(step, "velocity", seen.command.granted().velocity(), unit + "/s");
  if (auto judgement = judge_motion(seen, unit); judgement.verdict != VERDICT_PASSED) {
    if (proves && disproves_speed(seen.command)) record_.set_speed(SPEED_PROOF_WRONG);
    return judgement;
  }
  if (proves)
    if (auto judgement = prove_speed(start, run, distance, step); judgement.verdict != VERDICT_PASSED)
      return judgement;
  const auto right = dialogue_.choose(
      fmt::format("The drive says that it moved {}. Did the machine move by that much, in the {} direction?",
                  with_sign(seen.travelled, unit), plan.positive ? "positive" : "negative"),
      {"yes", "no"}, step);
  if (!right) throw StepEnd(VERDICT_SKIPPED, "nobody said whether it moved");
  if (*right == "no") {
    const auto what = dialogue_.choose("What did it do: move the other way, another distance, or nothing?",
                                       {"other-way", "distance", "nothing"}, step);
    seen.seen = what == "distance"  ? Seen::other_distance
                : what == "nothing" ? Seen::nothing
                                    : Seen::other_way;
  }
  return judge_jog(seen, unit);
}

/// Its manual does not say that the drive starts so: now it has.
Judgement Procedure::one_frame() const {
  return {.verdict = VERDICT_PASSED,
          .reason = fmt::format("the drive starts in one frame: axes.{}.drive.start_in_one_frame stays true",
                                axis_.name()),
          .remedy = {}};
}

Judgement Procedure::prove_speed(const v1::AxisState& start, const Run& run, double distance, Step& step) {
  SpeedObservation move{.axis = axis_.name(),
                        .command = run.command,
                        .distance = distance,
                        .described_by_file = config::is_described_by_file(record_.model()),
                        .samples = {start}};
  for (auto sample : run.samples) {
    sample.set_position(unwrapped(sample.position(), move.samples.back().position(), settings_));
    move.samples.push_back(std::move(sample));
  }
  const auto figures = measure_speed(move);
  add_figure(step, "time_told", figures.told, "s");
  if (figures.most > 0) {
    add_figure(step, "time_at_least", figures.least, "s");
    add_figure(step, "time_at_most", figures.most, "s");
  }
  auto [proof, judgement] = judge_speed(move, record_.unit());
  record_.set_speed(proof);
  return judgement;
}

Judgement Procedure::stop(Step& step) {
  const auto& unit = record_.unit();
  const auto before = axis_.state();
  const double wanted = stop_distance(motion_, settings_);
  const double up = bounded(wanted, true, before, settings_);
  const double down = bounded(wanted, false, before, settings_);
  const bool positive = up >= down;
  const auto motion = stop_motion(motion_, std::max(up, down), velocities_, settings_);
  const double distance = positive ? motion.distance : -motion.distance;
  if (distance == 0) throw StepEnd(VERDICT_NOT_DONE, no_room(before), room_remedy(before));
  check_move(distance, motion.velocity);
  const auto bound = axis_.budget(before.bus());
  permit(fmt::format("{}, but is stopped after about a third of it. Enter stops it, too. Move?",
                     move_text(distance, motion.velocity, before)),
         step);
  auto run = follow(axis_.move(distance, motion.velocity), step, [&](const v1::AxisState& state) {
    const auto way = unwrapped(state.position(), before.position(), settings_) - before.position();
    return std::abs(way) < std::abs(distance) * share_before_stop;
  });
  const auto called = now();
  StopObservation seen{
      .move = {}, .stop = axis_.stop(true), .unit = unit, .bound = {}, .way_bound = {}, .while_held = {}};
  const auto answered = now();
  const auto held = axis_.state();
  seen.while_held = axis_.explain_move(distance, motion.velocity);
  axis_.release_stop();
  const auto released = axis_.state();
  if (!ended(run.command)) {
    run.command = axis_.command(run.command.id());
    *step.add_commands() = run.command;
  }
  *step.add_commands() = seen.stop;
  seen.move = run.command;
  seen.moving = held.moving();
  seen.held = held.state() == v1::STATE_STOPPING && held.stop_held();
  seen.released = released.state() == v1::STATE_STANDSTILL;
  seen.time = seconds_between(seen.stop.accepted_at(), seen.stop.ended_at());
  const auto rest = unwrapped(held.position(), run.samples.back().position(), settings_);
  seen.at_target = std::abs(rest - before.position() - distance) <= std::abs(distance) * share_of_distance;
  seen.way = way_since(seen.stop.accepted_at(), run.samples, rest);
  add_figure(step, "velocity", seen.move.granted().velocity(), unit + "/s");
  add_figure(step, "standstill_after", seen.time, "s");
  if (bound && bound->stop_alone().has_standstill()) {
    seen.bound = seconds(bound->stop_alone().standstill()) + seconds(bound->deceleration_time());
    add_figure(step, "published_bound", *seen.bound, "s");
    // Published for the highest velocity. Beside it: the sample that the way is measured from is that old.
    const double share = seen.move.granted().velocity() / velocities_.maximum;
    seen.way_bound =
        bound->way_alone() * share + seen.move.granted().velocity() * seconds(bound->refresh_moving());
  }
  add_figure(step, "way", seen.way, unit);
  if (seen.way_bound) add_figure(step, "published_way", *seen.way_bound, unit);
  add_figure(step, "call_answered_after", seconds_between(called, answered), "s");
  return judge_stop(seen);
}

Judgement Procedure::home(Step& step) {
  const auto& unit = record_.unit();
  v1::ExplainRequest request;
  request.mutable_home();
  if (const auto response = axis_.explain(request); response.obstacles_size() > 0)
    for (const auto& one : response.obstacles())
      if (one.blocking()) throw StepEnd(VERDICT_FAILED, describe(one.detail(), axis_.name()));
  permit(fmt::format("It homes: {} at {}, until the switch ends it{}. Enter stops it. Home?",
                     settings_->homing_method, with_unit(settings_->homing_velocity, unit + "/s"),
                     settings_->homing_travel
                         ? fmt::format(" or {} lie behind", with_unit(*settings_->homing_travel, unit))
                         : ""),
         step);
  const auto run = follow(axis_.home(), step);
  const auto after = settled();
  add_figure(step, "position", after.position(), unit);
  return judge_homing(run.command, after);
}

Judgement Procedure::soft_limits() {
  const double low = *settings_->position_minimum;
  const double high = *settings_->position_maximum;
  // Asked about, never sent: a daemon that did not refuse it would move.
  const double beyond = (high - low) / 10;
  return judge_soft_limits(axis_.explain_target(high + beyond), axis_.explain_target(low - beyond));
}

Judgement Procedure::disable(Step& step) {
  if (!axis_.state().enabled()) return {.verdict = VERDICT_PASSED, .reason = "it is off", .remedy = {}};
  const bool falls = settings_ && settings_->vertical;
  const auto permission =
      dialogue_.permit(fmt::format("Switch the power stage off again{}?",
                                   falls ? "; the load hangs, and may fall without it" : ""),
                       step);
  if (!permission.granted)
    return {.verdict = VERDICT_NOT_APPLICABLE,
            .reason = "left on, as the operator chose: " + permission.reason,
            .remedy = {}};
  const auto run = follow(axis_.disable(), step);
  if (run.command.state() != v1::COMMAND_STATE_DONE || axis_.state().enabled())
    return {.verdict = VERDICT_FAILED, .reason = command_line(run.command, record_.unit()), .remedy = {}};
  return {};
}

}  // namespace axisd::axisctl::commission
