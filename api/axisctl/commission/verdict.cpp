#include "api/axisctl/commission/verdict.hpp"

#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "api/axisctl/commission/plan.hpp"
#include "api/axisctl/error.hpp"
#include "api/axisctl/format.hpp"

namespace axisd::axisctl::commission {
namespace {

Judgement failed(std::string reason, std::string remedy = {}) {
  return {.verdict = VERDICT_FAILED, .reason = std::move(reason), .remedy = std::move(remedy)};
}

std::string with_function(const std::string& terminal, const std::string& function) {
  return function.empty() ? terminal : fmt::format("{} ({})", terminal, function);
}

std::string key_of(const ExpectedInput& input) {
  return fmt::format("axes.{}.inputs.{}", input.axis, input.terminal);
}

/// "MoveRelative ended Aborted: the drive came to rest at 3 mm; check terminals".
std::string end_of(const v1::Command& command) {
  return fmt::format("{} ended {}{}", command_kind(command), command_state(command),
                     command.has_cause() ? ": " + describe(command.cause(), command.axis()) : "");
}

/// Where the middle of a way begins, and as far before its end it ends.
constexpr double share_of_edge = 0.1;
/// What a speed may be off: of the time, and s. A drive may tell positions that are so old.
constexpr double share_of_time = 0.05, staleness = 0.05;

/// The time to go so far from rest: with the ramp first.
double time_to(double way, double velocity, double ramp) {
  const double in_ramp = velocity * ramp / 2;
  return way < in_ramp ? std::sqrt(2 * way * ramp / velocity) : ramp / 2 + way / velocity;
}

/// The time of the middle of a way.
double middle_time(double distance, double velocity, double acceleration_time, double deceleration_time) {
  const double in_ramps = velocity * (acceleration_time + deceleration_time) / 2;
  // Too short for the velocity: the ramps meet earlier, both in the same proportion.
  const double share = in_ramps > distance ? std::sqrt(distance / in_ramps) : 1;
  const double top = velocity * share;
  const double up = acceleration_time * share;
  const double down = deceleration_time * share;
  const double whole = up + down + std::max(0.0, distance - in_ramps) / velocity;
  const double edge = distance * share_of_edge;
  return whole - time_to(edge, top, up) - time_to(edge, top, down);
}

std::string time_range(double from, double to) {
  const auto least = duration_text(from);
  const auto most = duration_text(to);
  return least == most ? least : fmt::format("{} to {}", least, most);
}

/// Where an axis is not as fast as it was told to be: by the keys that its model has.
std::string compare_units(const std::string& axis, bool described_by_file) {
  const auto scale = fmt::format("compare axes.{}.scale (microstep: pulses per revolution; gear)", axis);
  const auto with = described_by_file
                        ? fmt::format(
                              ", axes.{}.drive.velocity_unit and the ramps with the drive and its unit "
                              "objects (6091h, 6093h to 6097h, 60A9h, 60AAh)",
                              axis)
                        : std::string(" with the drive");
  return fmt::format("{}{}; reload the configuration, and try again", scale, with);
}

bool done(const v1::Command& command) { return command.state() == v1::COMMAND_STATE_DONE; }

double seconds_of(const google::protobuf::Timestamp& time) {
  return static_cast<double>(google::protobuf::util::TimeUtil::TimestampToNanoseconds(time)) / 1e9;
}

}  // namespace

bool is_output(const v1::AxisState& axis, const std::string& terminal) {
  return std::ranges::any_of(axis.outputs(), [&](const auto& output) { return output.name() == terminal; });
}

Judgement judge_switch(const ExpectedInput& expected, const std::vector<v1::TerminalEdge>& edges) {
  std::vector<v1::TerminalEdge> own;
  std::vector<v1::TerminalEdge> others;
  for (const auto& edge : edges) (edge.terminal() == expected.terminal ? own : others).push_back(edge);
  const auto name = with_function(expected.terminal, expected.function);
  if (own.empty() && others.empty())
    return failed("no terminal changed", "check the switch, its supply and its wiring");
  if (own.empty()) {
    const auto& other = others.front();
    return failed(fmt::format("{} changed, expected {}: swapped?",
                              with_function(other.terminal(), other.function()), name),
                  fmt::format("swap the wires, or give {} the function {} (axes.{}.inputs)", other.terminal(),
                              expected.function, expected.axis));
  }
  if (!others.empty())
    return failed(
        fmt::format("{} changed, too", with_function(others.front().terminal(), others.front().function())),
        "actuate one switch at a time; else look for a short between the wires");
  if (!own.front().active()) return wrong_polarity(expected);
  if (own.back().active())
    return failed(fmt::format("{} stayed active", expected.terminal), "does the switch hang?");
  return {};
}

Judgement wrong_polarity(const ExpectedInput& expected) {
  if (expected.active.empty())
    return failed("active at rest, inactive while actuated: the polarity is wrong",
                  fmt::format("change `active` of {}", key_of(expected)));
  const bool low = expected.active == "low";
  return failed(fmt::format("active at rest: the polarity (active: {}) is wrong", expected.active),
                fmt::format("{}: {{ function: {}, active: {} }}", key_of(expected), expected.function,
                            low ? "high" : "low"));
}

Judgement judge_motion(const JogObservation& jog, const std::string& unit) {
  const auto reason = jog.command.cause().reason();
  if (jog.in_one_frame && (reason == v1::REASON_DID_NOT_START || reason == v1::REASON_REFUSED))
    return failed(
        fmt::format("the drive does not start in one frame: {}", end_of(jog.command)),
        fmt::format("remove axes.{}.drive.start_in_one_frame; reload the configuration, reset the axis, "
                    "and try again",
                    jog.axis));
  if (!done(jog.command))
    return failed(end_of(jog.command), jog.command.cause().reason() == v1::REASON_TOOK_TOO_LONG
                                           ? compare_units(jog.axis, jog.described_by_file)
                                           : fmt::format("axisctl explain {}", jog.axis));
  if (std::abs(jog.travelled - jog.distance) > jog.tolerance)
    return failed(
        fmt::format("the position changed by {} instead of {}", with_unit(jog.travelled, unit),
                    with_unit(jog.distance, unit)),
        fmt::format("look for what moved the axis beside this command{}",
                    jog.measured ? fmt::format("; compare axes.{}.scale.microstep (counts of a "
                                               "revolution) with the encoder, and look at the coupling",
                                               jog.axis)
                                 : ""));
  return {};
}

Judgement judge_jog(const JogObservation& jog, const std::string& unit) {
  if (auto judgement = judge_motion(jog, unit); judgement.verdict != VERDICT_PASSED) return judgement;
  switch (jog.seen) {
    case Seen::as_told:
      return {};
    case Seen::other_way:
      return failed("it moved the other way",
                    fmt::format("axes.{}.scale: {{ invert: {} }}", jog.axis, !jog.invert));
    case Seen::other_distance:
      return failed(
          fmt::format("it moved another distance than {}", with_unit(std::abs(jog.distance), unit)),
          fmt::format("compare axes.{}.scale (microstep, gear, travel) with the mechanics", jog.axis));
    case Seen::nothing:
      return failed("it did not move, though its position did",
                    "check the motor's cable and current, and the coupling");
  }
  return failed("no verdict");
}

bool disproves_speed(const v1::Command& command) {
  const auto reason = command.cause().reason();
  return done(command) || reason == v1::REASON_TOOK_TOO_LONG || reason == v1::REASON_MISCONFIGURED;
}

SpeedFigures measure_speed(const SpeedObservation& move) {
  const double distance = std::abs(move.distance);
  const double velocity = move.command.granted().velocity();
  const double up = seconds(move.command.granted().acceleration_time());
  const double down = seconds(move.command.granted().deceleration_time());
  SpeedFigures figures{.told = middle_time(distance, velocity, up, down),
                       .way = distance * (1 - 2 * share_of_edge)};
  // The last sample before each end of the middle, and the first behind it.
  std::array<std::optional<double>, 2> before;
  std::array<std::optional<double>, 2> behind;
  for (const auto& sample : move.samples) {
    const double way = (sample.position() - move.samples.front().position()) / move.distance;
    const double at = seconds_of(sample.measured_at());
    for (const std::size_t end : {0U, 1U}) {
      const double place = end == 0 ? share_of_edge : 1 - share_of_edge;
      if (way < place && !behind[end]) before[end] = at;
      if (way >= place && !behind[end]) behind[end] = at;
    }
  }
  if (!before[0] || !before[1] || !behind[0] || !behind[1]) return figures;
  figures.least = std::max(0.0, *before[1] - *behind[0]);
  figures.most = *behind[1] - *before[0];
  return figures;
}

SpeedJudgement judge_speed(const SpeedObservation& move, const std::string& unit) {
  const auto figures = measure_speed(move);
  const double tolerance = figures.told * share_of_time + staleness;
  const bool slow = figures.least > figures.told + tolerance;
  const bool fast = figures.most < figures.told - tolerance;
  const auto told = fmt::format("{} were told for it at {}", duration_text(figures.told),
                                with_unit(move.command.granted().velocity(), unit + "/s"));
  if (figures.most > 0 && (slow || fast)) {
    auto reason = fmt::format("it was in the middle {} of its way for {}, and {}: it is too {}",
                              with_unit(figures.way, unit), time_range(figures.least, figures.most), told,
                              slow ? "slow" : "fast");
    return {.proof = SPEED_PROOF_WRONG,
            .judgement = failed(std::move(reason), compare_units(move.axis, move.described_by_file))};
  }
  if (figures.most == 0 || figures.most - figures.least + tolerance > figures.told / 2)
    return {.proof = SPEED_PROOF_UNSPECIFIED,
            .judgement = failed(fmt::format("too short to tell its speed: {}, and its samples leave open {}",
                                            told, time_range(figures.least, figures.most)),
                                "give a longer --distance, or a lower --velocity")};
  return {.proof = SPEED_PROOF_PROVEN, .judgement = {}};
}

std::string limit_instead(const v1::TerminalEdge& edge, const std::string& expected) {
  if (edge.terminal() == expected || !edge.active() || !is_limit(edge.function())) return {};
  return with_function(edge.terminal(), edge.function());
}

Judgement judge_limit_end(const LimitObservation& limit) {
  const auto name = with_function(limit.input.terminal, limit.input.function);
  if (limit.moving)
    return failed(fmt::format("it still moves although {} is active", name), "look at the machine");
  if (limit.stopped && limit.became_active)
    return failed(fmt::format("{} became active, too", limit.other), "look for a short between the wires");
  if (done(limit.command) || limit.stopped) {
    if (!limit.became_active && !limit.other.empty())
      return failed(fmt::format("{} became active on the way, not {}: swapped?", limit.other, name),
                    fmt::format("swap the wires, or the functions in axes.{}.inputs", limit.input.axis));
    if (!limit.became_active)
      return failed(fmt::format("{} did not become active on the way", name),
                    "actuate the switch while the axis moves, or begin closer to it");
    return failed(fmt::format("{} became active, and the axis went on", name),
                  fmt::format("compare {} with the direction that the axis moves in", key_of(limit.input)));
  }
  const bool by_limit = limit.command.state() == v1::COMMAND_STATE_ABORTED &&
                        limit.command.cause().reason() == v1::REASON_LIMIT_SWITCH;
  if (by_limit) return {};
  if (limit.became_active && limit.command.cause().reason() == v1::REASON_DID_NOT_START)
    return failed(end_of(limit.command), "let it move before the switch is actuated");
  return failed(end_of(limit.command), limit.became_active
                                           ? fmt::format("was {} released too early?", limit.input.terminal)
                                           : fmt::format("axisctl explain {}", limit.input.axis));
}

Judgement judge_limit(const LimitObservation& limit) {
  if (auto judgement = judge_limit_end(limit); judgement.verdict != VERDICT_PASSED) return judgement;
  if (blocked_by(limit.further, v1::REASON_LIMIT_SWITCH) == nullptr)
    return failed("motion further in that direction is not refused", "keep the switch actuated meanwhile");
  if (!limit.away)
    return {
        .verdict = VERDICT_SKIPPED, .reason = "motion away from it: " + limit.away_left_out, .remedy = {}};
  if (!done(*limit.away)) return failed("motion away from it: " + end_of(*limit.away));
  return {};
}

Judgement judge_stop(const StopObservation& stop) {
  if (!done(stop.stop))
    return failed("standstill is not confirmed: " + end_of(stop.stop), "look at the machine");
  if (stop.moving) return failed("it still moves", "look at the machine");
  if (stop.move.state() != v1::COMMAND_STATE_ABORTED)
    return failed("the move was over before the stop: " + end_of(stop.move),
                  "give a longer --distance, or a lower --velocity");
  if (stop.at_target)
    return failed("it went on to its target: the stop did not end it", "look at the bus (axisctl trace)");
  if (stop.bound && stop.time > *stop.bound)
    return failed(fmt::format("standstill after {}, published bound {}", duration_text(stop.time),
                              duration_text(*stop.bound)),
                  "axisctl budget shows what the bound is made of");
  if (stop.way_bound && stop.way > *stop.way_bound)
    return failed(fmt::format("{} until it rested, by the published bound {}", with_unit(stop.way, stop.unit),
                              with_unit(*stop.way_bound, stop.unit)),
                  "check load and deceleration time");
  if (!stop.held || blocked_by(stop.while_held, v1::REASON_STOPPING) == nullptr)
    return failed("the axis was not held until ReleaseStop");
  if (!stop.released) return failed("the axis is not at Standstill after ReleaseStop");
  return {.reason = stop.bound ? "" : "the bus publishes no bound for it", .remedy = {}};
}

Judgement judge_soft_limits(const v1::ExplainResponse& above, const v1::ExplainResponse& below) {
  for (const auto* response : {&above, &below}) {
    if (blocked_by(*response, v1::REASON_SOFT_LIMIT) != nullptr) continue;
    if (const auto* lost = blocked_by(*response, v1::REASON_NOT_TRUSTED))
      return {.verdict = VERDICT_NOT_DONE,
              .reason = "the position is unknown, so that soft limits do not count",
              .remedy = lost->remedy()};
    return failed(
        fmt::format("a target {} the soft limits is not refused", response == &above ? "above" : "below"));
  }
  return {};
}

Judgement judge_homing(const v1::Command& command, const v1::AxisState& after) {
  if (!done(command)) return failed(end_of(command), fmt::format("axisctl explain {} home", command.axis()));
  if (after.trust() != v1::POSITION_TRUST_HOMED) return failed("it is not homed afterwards");
  return {};
}

const v1::ErrorDetail* blocked_by(const v1::ExplainResponse& response, v1::Reason reason) {
  for (const auto& obstacle : response.obstacles())
    if (obstacle.blocking() && obstacle.detail().reason() == reason) return &obstacle.detail();
  return nullptr;
}

double way_since(const google::protobuf::Timestamp& since, const std::vector<v1::AxisState>& samples,
                 double rest) {
  const double moment = seconds_of(since);
  const v1::AxisState* before = nullptr;
  const v1::AxisState* after = nullptr;
  for (const auto& sample : samples) {
    if (seconds_of(sample.measured_at()) <= moment) before = &sample;
    if (seconds_of(sample.measured_at()) > moment && after == nullptr) after = &sample;
  }
  if (before == nullptr) return after == nullptr ? 0 : std::abs(rest - after->position());
  double position = before->position();
  if (after != nullptr) {
    const double begin = seconds_of(before->measured_at());
    const double share = (moment - begin) / (seconds_of(after->measured_at()) - begin);
    position += share * (after->position() - before->position());
  } else {
    position += before->velocity() * (moment - seconds_of(before->measured_at()));
  }
  return std::abs(rest - position);
}

}  // namespace axisd::axisctl::commission
