#include "api/axisctl/commission/plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace axisd::axisctl::commission {
namespace {

constexpr double share_of_velocity = 0.05, share_of_range = 0.05, share_of_proof = 0.1;
constexpr double jog_seconds = 2, proof_seconds = 1;
/// A hand needs so long to reach a switch after the motion has begun; after so long nobody will.
constexpr double hand_seconds = 10, longest_hand_seconds = 30;

const Step* find(const Record& record, const std::string& name) {
  const auto found = std::ranges::find(record.steps(), name, &Step::name);
  return found == record.steps().end() ? nullptr : &*found;
}

bool passed(const Record& record, const std::string& name) {
  const auto* step = find(record, name);
  return step != nullptr && (step->verdict() == VERDICT_PASSED || step->verdict() == VERDICT_NOT_APPLICABLE);
}

bool failed(const Record& record, const std::string& name) {
  const auto* step = find(record, name);
  return step != nullptr && step->verdict() == VERDICT_FAILED;
}

/// A limit switch that does not work blocks the wrong direction, or none.
std::string failed_switch(const std::vector<StepPlan>& steps, const Record& record) {
  for (const auto& step : steps)
    if (step.kind == StepKind::input && is_limit(step.function) && failed(record, step.name))
      return fmt::format("{} did not pass", step.name);
  return {};
}

/// Moves further than a jog need both directions proven.
std::string unproven_direction(const Record& record) {
  for (const auto* jog : {"jog positive", "jog negative"})
    if (failed(record, jog)) return fmt::format("{} did not pass", jog);
  if (!passed(record, "jog positive") && !passed(record, "jog negative"))
    return "the direction was not proven";
  return {};
}

/// What the axis was not seen to do slowly it must not do faster.
std::string unproven_speed(const Record& record) {
  switch (record.speed()) {
    case SPEED_PROOF_PROVEN:
      return {};
    case SPEED_PROOF_WRONG:
      return "the axis is not as fast as it was told to be";
    default:
      return "the speed was not proven";
  }
}

/// Why the jogs tell nothing of starts in one frame; empty: they do.
std::string not_in_one_frame(const std::optional<Settings>& settings) {
  if (!settings) return "the configuration is not known here";
  if (!settings->may_start_in_one_frame) return "its starts have more than one frame";
  if (!settings->starts_in_one_frame)
    return fmt::format(
        "axes.{}.drive.start_in_one_frame is false: with true the jogs try whether the drive starts so, "
        "which "
        "takes less of the line",
        settings->axis);
  return {};
}

/// Of a move that is to be stopped on its way.
double stop_seconds(const std::optional<Settings>& settings) {
  const double ramps = settings ? settings->acceleration_time + settings->deceleration_time : 1;
  return 2 * (1 + ramps);
}

/// To a motion that goes as far as a switch or a person lets it.
std::string obstacle_to_motion(const std::vector<StepPlan>& steps, const Record& record) {
  if (!passed(record, "power on")) return "the power stage is off";
  if (auto why = unproven_direction(record); !why.empty()) return why;
  if (auto why = unproven_speed(record); !why.empty()) return why;
  return failed_switch(steps, record);
}

/// Homing runs until a switch ends it: one that does not end a motion must not be relied on.
std::string obstacle_to_homing(const std::vector<StepPlan>& steps, const Record& record) {
  if (auto why = obstacle_to_motion(steps, record); !why.empty()) return why;
  for (const auto& other : steps)
    if ((other.kind == StepKind::limit || other.kind == StepKind::input) && failed(record, other.name))
      return fmt::format("{} did not pass", other.name);
  return failed(record, "stop") ? "stop did not pass" : "";
}

}  // namespace

bool is_limit(const std::string& function) {
  return function == "positive_limit" || function == "negative_limit";
}

std::vector<StepPlan> plan_steps(const v1::AxisState& state, const std::optional<Settings>& settings) {
  std::vector<StepPlan> steps;
  const auto add = [&](StepKind kind, std::string name, std::string not_applicable = {}) -> StepPlan& {
    return steps.emplace_back(StepPlan{.kind = kind,
                                       .name = std::move(name),
                                       .terminal = {},
                                       .function = {},
                                       .not_applicable = std::move(not_applicable)});
  };
  add(StepKind::identity, "identity");
  add(StepKind::release, "power off", state.enabled() ? "" : "the power stage is off already");
  if (std::ranges::all_of(state.inputs(), [](const auto& input) { return input.function().empty(); }))
    add(StepKind::input, "switches", "no input terminal has a function (inputs: of the axis)");
  for (const auto& terminal : state.inputs()) {
    if (terminal.function().empty()) continue;
    auto& step = add(StepKind::input, "switch " + terminal.name());
    step.terminal = terminal.name();
    step.function = terminal.function();
  }
  add(StepKind::enable, "power on");
  for (const bool positive : {true, false})
    add(StepKind::jog, positive ? "jog positive" : "jog negative").positive = positive;
  add(StepKind::one_frame, "start in one frame", not_in_one_frame(settings));
  for (const bool positive : {true, false}) {
    const std::string function = positive ? "positive_limit" : "negative_limit";
    const auto found = std::ranges::find(state.inputs(), function, &v1::Terminal::function);
    const bool there = found != state.inputs().end();
    auto& step = add(StepKind::limit, positive ? "limit positive" : "limit negative",
                     there ? "" : fmt::format("no input has the function {}", function));
    step.positive = positive;
    step.function = function;
    if (there) step.terminal = found->name();
  }
  add(StepKind::stop, "stop");
  const bool homes = settings && !settings->homing_method.empty();
  add(StepKind::home, "homing", homes ? "" : "no homing is configured");
  const bool limited = settings && settings->position_minimum;
  add(StepKind::soft_limits, "soft limits", limited ? "" : "no limits: { position: } are configured");
  add(StepKind::disable, "power off again");
  return steps;
}

std::string obstacle(const StepPlan& step, const std::vector<StepPlan>& steps, const Record& record) {
  if (step.kind == StepKind::identity) return {};
  if (!passed(record, "identity")) return "the axis cannot be commanded";
  switch (step.kind) {
    case StepKind::input:
      return passed(record, "power off") ? "" : "the power stage is on: no hands at the switches";
    case StepKind::jog:
      if (!passed(record, "power on")) return "the power stage is off";
      return record.speed() == SPEED_PROOF_WRONG ? unproven_speed(record) : "";
    case StepKind::one_frame:
      return passed(record, "jog positive") || passed(record, "jog negative") ? "" : "no jog has passed";
    case StepKind::limit:
    case StepKind::stop:
      return obstacle_to_motion(steps, record);
    case StepKind::home:
      return obstacle_to_homing(steps, record);
    default:
      return {};
  }
}

Motion default_motion(VelocityRange permitted, const std::optional<Settings>& settings,
                      std::optional<double> velocity, std::optional<double> distance) {
  Motion motion;
  motion.velocity = velocity.value_or(std::max(permitted.maximum * share_of_velocity, permitted.minimum));
  motion.distance = motion.velocity * jog_seconds;
  if (settings && settings->position_minimum && settings->position_maximum)
    motion.distance = std::min(motion.distance,
                               (*settings->position_maximum - *settings->position_minimum) * share_of_range);
  if (distance) motion.distance = *distance;
  return motion;
}

double proving_velocity(VelocityRange permitted, double usual, double distance) {
  const double tenth = permitted.maximum * share_of_proof;
  const double slow = std::max(std::min(tenth, distance / proof_seconds), permitted.minimum);
  return std::min(slow, usual);
}

double bounded(double wanted, bool positive, const v1::AxisState& state,
               const std::optional<Settings>& settings) {
  if (!settings || !settings->position_minimum || !settings->position_maximum) return wanted;
  if (state.trust() == v1::POSITION_TRUST_UNKNOWN) return std::min(wanted, settings->jog_travel);
  const double room = positive ? *settings->position_maximum - state.position()
                               : state.position() - *settings->position_minimum;
  return std::clamp(room, 0.0, wanted);
}

Motion limit_motion(Motion motion, double room, VelocityRange permitted) {
  const double wanted = motion.velocity * longest_hand_seconds;
  motion.distance = std::min(wanted, room);
  motion.velocity = std::clamp(motion.distance / hand_seconds, std::min(permitted.minimum, motion.velocity),
                               motion.velocity);
  return motion;
}

double stop_distance(Motion motion, const std::optional<Settings>& settings) {
  return std::max(motion.distance, motion.velocity * stop_seconds(settings));
}

Motion stop_motion(Motion motion, double room, VelocityRange permitted,
                   const std::optional<Settings>& settings) {
  motion.distance = std::min(stop_distance(motion, settings), room);
  motion.velocity = std::clamp(motion.distance / stop_seconds(settings),
                               std::min(permitted.minimum, motion.velocity), motion.velocity);
  return motion;
}

double unwrapped(double position, double reference, const std::optional<Settings>& settings) {
  if (!settings || !settings->modulo) return position;
  return reference + std::remainder(position - reference, *settings->modulo);
}

double duration_of(double distance, double velocity, const std::optional<Settings>& settings) {
  const double ramps = settings ? (settings->acceleration_time + settings->deceleration_time) / 2 : 0;
  return velocity > 0 ? distance / velocity + ramps : 0;
}

}  // namespace axisd::axisctl::commission
