#include <gmock/gmock.h>

#include <algorithm>
#include <utility>

#include "api/axisctl/commission/verdict.hpp"

namespace axisd::axisctl::commission {
namespace {

using testing::HasSubstr;
using testing::Not;

v1::TerminalEdge edge(const char* terminal, bool active, const char* function = "") {
  v1::TerminalEdge edge;
  edge.set_terminal(terminal);
  edge.set_function(function);
  edge.set_active(active);
  return edge;
}

v1::Command command(v1::CommandState state, v1::Reason cause = v1::REASON_UNSPECIFIED) {
  v1::Command command;
  command.set_axis("feeder");
  command.set_kind(v1::COMMAND_KIND_MOVE_RELATIVE);
  command.set_state(state);
  if (cause != v1::REASON_UNSPECIFIED) command.mutable_cause()->set_reason(cause);
  return command;
}

v1::ExplainResponse obstacle(v1::Reason reason, bool blocking = true) {
  v1::ExplainResponse response;
  auto& one = *response.add_obstacles();
  one.set_blocking(blocking);
  one.mutable_detail()->set_reason(reason);
  return response;
}

const ExpectedInput home{.axis = "feeder", .terminal = "X0", .function = "home", .active = "high"};

TEST(JudgeSwitch, PassesWhereItAloneWasActuatedAndReleased) {
  EXPECT_EQ(judge_switch(home, {edge("X0", true), edge("X0", false)}).verdict, VERDICT_PASSED);
}

TEST(JudgeSwitch, NamesTheTerminalThatReactedInstead) {
  const auto judgement = judge_switch(home, {edge("X2", true, "negative_limit"), edge("X2", false)});
  EXPECT_EQ(judgement.verdict, VERDICT_FAILED);
  EXPECT_EQ(judgement.reason, "X2 (negative_limit) changed, expected X0 (home): swapped?");
  EXPECT_THAT(judgement.remedy, HasSubstr("give X2 the function home"));
}

TEST(JudgeSwitch, FailsWhereAnotherChangedToo) {
  const auto judgement = judge_switch(home, {edge("X0", true), edge("X3", true), edge("X0", false)});
  EXPECT_EQ(judgement.verdict, VERDICT_FAILED);
  EXPECT_EQ(judgement.reason, "X3 changed, too");
}

TEST(JudgeSwitch, KnowsOutputsByTheAxis) {
  v1::AxisState axis;
  axis.add_inputs()->set_name("X0");
  axis.add_outputs()->set_name("Y0");
  EXPECT_TRUE(is_output(axis, "Y0"));
  EXPECT_FALSE(is_output(axis, "X0"));
}

TEST(JudgeSwitch, FailsWhereNothingChangedOrItHangs) {
  EXPECT_EQ(judge_switch(home, {}).reason, "no terminal changed");
  EXPECT_EQ(judge_switch(home, {edge("X0", true)}).reason, "X0 stayed active");
}

TEST(JudgeSwitch, TellsTheKeyOfAWrongPolarity) {
  auto input = home;
  EXPECT_EQ(judge_switch(input, {edge("X0", false), edge("X0", true)}).remedy,
            "axes.feeder.inputs.X0: { function: home, active: low }");
  input.active = "low";
  EXPECT_EQ(wrong_polarity(input).remedy, "axes.feeder.inputs.X0: { function: home, active: high }");
  EXPECT_THAT(wrong_polarity(input).reason, HasSubstr("(active: low) is wrong"));
  input.active.clear();
  EXPECT_EQ(wrong_polarity(input).remedy, "change `active` of axes.feeder.inputs.X0");
}

JogObservation jog() {
  return {.axis = "feeder",
          .command = command(v1::COMMAND_STATE_DONE),
          .distance = -10,
          .travelled = -9.95,
          .tolerance = 0.1};
}

TEST(JudgeJog, PassesAsTold) { EXPECT_EQ(judge_jog(jog(), "mm").verdict, VERDICT_PASSED); }

TEST(JudgeJog, FailsWhereTheMoveDid) {
  auto seen = jog();
  seen.command = command(v1::COMMAND_STATE_ABORTED, v1::REASON_ALARM);
  EXPECT_EQ(judge_jog(seen, "mm").reason, "MoveRelative ended Aborted: alarm");
  seen = jog();
  seen.travelled = -9;
  EXPECT_EQ(judge_jog(seen, "mm").reason, "the position changed by -9 mm instead of -10 mm");
}

TEST(JudgeJog, TellsTheKeyByWhatWasSeen) {
  auto seen = jog();
  seen.seen = Seen::other_way;
  EXPECT_EQ(judge_jog(seen, "mm").remedy, "axes.feeder.scale: { invert: true }");
  seen.invert = true;
  EXPECT_EQ(judge_jog(seen, "mm").remedy, "axes.feeder.scale: { invert: false }");
  seen.seen = Seen::other_distance;
  EXPECT_THAT(judge_jog(seen, "mm").remedy, HasSubstr("axes.feeder.scale (microstep, gear, travel)"));
  seen.seen = Seen::nothing;
  EXPECT_EQ(judge_jog(seen, "mm").verdict, VERDICT_FAILED);
}

TEST(JudgeJog, NamesTheUnitsOfAMoveThatTookTooLong) {
  auto seen = jog();
  seen.command = command(v1::COMMAND_STATE_ERROR, v1::REASON_TOOK_TOO_LONG);
  EXPECT_EQ(judge_jog(seen, "mm").remedy,
            "compare axes.feeder.scale (microstep: pulses per revolution; gear) with the drive; reload the "
            "configuration, and try again");
  seen.described_by_file = true;
  EXPECT_THAT(judge_jog(seen, "mm").remedy, HasSubstr("axes.feeder.drive.velocity_unit"));
  EXPECT_TRUE(disproves_speed(seen.command));
  EXPECT_FALSE(disproves_speed(command(v1::COMMAND_STATE_ABORTED, v1::REASON_ALARM)));
}

/// A move of -10 mm that was told to take 2.15 s, at 5 mm/s with ramps of 100 and 200 ms. It takes `factor`
/// times as long, and is read every `period` ms.
SpeedObservation measured_move(double factor, int period = 20) {
  SpeedObservation move{
      .axis = "feeder", .command = command(v1::COMMAND_STATE_DONE), .distance = -10, .samples = {}};
  auto& granted = *move.command.mutable_granted();
  granted.set_velocity(5);
  granted.mutable_acceleration_time()->set_nanos(100'000'000);
  granted.mutable_deceleration_time()->set_nanos(200'000'000);
  const auto way = [](double time) {
    if (time < 0) return 0.0;
    if (time < 0.1) return 25 * time * time;
    if (time < 1.95) return 0.25 + (5 * (time - 0.1));
    if (time < 2.15) return 10 - (12.5 * (2.15 - time) * (2.15 - time));
    return 10.0;
  };
  for (int at = -period; at < 2300 * factor + 2 * period; at += period) {
    v1::AxisState state;
    state.mutable_measured_at()->set_seconds(1000 + ((at + 1000) / 1000));
    state.mutable_measured_at()->set_nanos((at + 1000) % 1000 * 1'000'000);
    state.set_position(3 - way(at / 1000.0 / factor));
    move.samples.push_back(state);
  }
  return move;
}

TEST(JudgeSpeed, ProvesAMoveThatTakesAsLongAsTold) {
  const auto move = measured_move(1);
  const auto figures = measure_speed(move);
  EXPECT_NEAR(figures.told, 1.6, 0.03);  // 8 mm, and a little of the ramp before the stop
  EXPECT_LE(figures.least, figures.told);
  EXPECT_GE(figures.most, figures.told);
  EXPECT_LE(figures.most - figures.least, 0.05);
  EXPECT_EQ(judge_speed(move, "mm").proof, SPEED_PROOF_PROVEN);
  EXPECT_EQ(judge_speed(move, "mm").judgement.verdict, VERDICT_PASSED);
}

TEST(JudgeSpeed, TellsBothFiguresAndTheKeysOfAWrongSpeed) {
  for (const double factor : {0.1, 0.5, 0.85, 1.15, 2.0, 10.0}) {
    const auto judged = judge_speed(measured_move(factor), "mm");
    EXPECT_EQ(judged.proof, SPEED_PROOF_WRONG) << factor;
    EXPECT_EQ(judged.judgement.verdict, VERDICT_FAILED) << factor;
    EXPECT_THAT(judged.judgement.reason, HasSubstr(factor < 1 ? "too fast" : "too slow"));
    EXPECT_THAT(judged.judgement.reason, HasSubstr("were told for it at 5 mm/s"));
    EXPECT_THAT(judged.judgement.remedy,
                HasSubstr("axes.feeder.scale (microstep: pulses per revolution; gear)"));
    EXPECT_THAT(judged.judgement.remedy, Not(HasSubstr("velocity_unit"))) << "it has no such key";
  }
}

/// Long ramps: 3 s from rest to 5 mm/s, and 0.5 s to rest, as granted. These are what the shaft does.
SpeedObservation slow_start(double acceleration_time, double deceleration_time) {
  auto move = measured_move(1);
  move.samples.clear();
  move.distance = 20;
  move.described_by_file = true;
  auto& granted = *move.command.mutable_granted();
  granted.mutable_acceleration_time()->set_seconds(3);
  granted.mutable_acceleration_time()->set_nanos(0);
  granted.mutable_deceleration_time()->set_nanos(500'000'000);
  const double up = 5 * acceleration_time / 2;
  const double down = 5 * deceleration_time / 2;
  const double steady = acceleration_time + (20 - up - down) / 5;
  const auto way = [&](double time) {
    if (time < acceleration_time) return up * time * time / (acceleration_time * acceleration_time);
    if (time < steady) return up + (5 * (time - acceleration_time));
    const double left = std::max(0.0, steady + deceleration_time - time) / deceleration_time;
    return 20 - (down * left * left);
  };
  for (int at = 0; at < 8000; at += 20) {
    v1::AxisState state;
    state.mutable_measured_at()->set_seconds(1000 + at / 1000);
    state.mutable_measured_at()->set_nanos(at % 1000 * 1'000'000);
    state.set_position(way(at / 1000.0));
    move.samples.push_back(state);
  }
  return move;
}

TEST(JudgeSpeed, RampsAreTheGrantedOnes) {
  for (const double rounding : {-0.0005, 0.0, 0.0005})
    EXPECT_EQ(judge_speed(slow_start(3 + rounding, 0.5 - rounding), "mm").proof, SPEED_PROOF_PROVEN);
  for (const bool by_file : {false, true}) {
    auto move = slow_start(3 * 1.9, 0.5);
    move.described_by_file = by_file;
    EXPECT_EQ(judge_speed(move, "mm").proof, SPEED_PROOF_WRONG);
  }
}

TEST(JudgeSpeed, ALongRampHidesNoWrongVelocity) {
  auto move = slow_start(3, 0.5);
  move.command.mutable_granted()->set_velocity(10);
  EXPECT_EQ(judge_speed(move, "mm").proof, SPEED_PROOF_WRONG) << "half as fast as told";
  move.command.mutable_granted()->set_velocity(2.5);
  EXPECT_EQ(judge_speed(move, "mm").proof, SPEED_PROOF_WRONG) << "twice as fast";
}

TEST(JudgeSpeed, AllowsForSamplesThatAreFarApart) {
  EXPECT_EQ(judge_speed(measured_move(1.15, 200), "mm").proof, SPEED_PROOF_PROVEN);
  EXPECT_EQ(judge_speed(measured_move(2, 200), "mm").proof, SPEED_PROOF_WRONG);
  EXPECT_EQ(judge_speed(measured_move(0.5, 200), "mm").proof, SPEED_PROOF_WRONG);
}

TEST(JudgeSpeed, DoesNotKnowWhatSamplesLeaveOpen) {
  const auto judged = judge_speed(measured_move(1, 700), "mm");
  EXPECT_EQ(judged.proof, SPEED_PROOF_UNSPECIFIED);
  EXPECT_EQ(judged.judgement.verdict, VERDICT_FAILED);
  EXPECT_THAT(judged.judgement.remedy, HasSubstr("--distance"));
  auto nothing = measured_move(1);
  nothing.samples.clear();
  EXPECT_EQ(judge_speed(nothing, "mm").proof, SPEED_PROOF_UNSPECIFIED);
}

LimitObservation limit() {
  return {.input = {.axis = "feeder", .terminal = "X1", .function = "positive_limit", .active = "high"},
          .command = command(v1::COMMAND_STATE_ABORTED, v1::REASON_LIMIT_SWITCH),
          .became_active = true,
          .further = obstacle(v1::REASON_LIMIT_SWITCH),
          .away = command(v1::COMMAND_STATE_DONE),
          .away_left_out = {}};
}

TEST(JudgeLimit, PassesWhereItStoppedForbadeAndLetGo) {
  EXPECT_EQ(judge_limit(limit()).verdict, VERDICT_PASSED);
}

TEST(JudgeLimit, FailsWhereTheAxisWentOn) {
  auto seen = limit();
  seen.command = command(v1::COMMAND_STATE_DONE);
  EXPECT_EQ(judge_limit(seen).reason, "X1 (positive_limit) became active, and the axis went on");
  seen.became_active = false;
  EXPECT_EQ(judge_limit(seen).reason, "X1 (positive_limit) did not become active on the way");
  seen.other = "X2 (negative_limit)";
  EXPECT_EQ(judge_limit(seen).reason,
            "X2 (negative_limit) became active on the way, not X1 (positive_limit): swapped?");
  seen.command = command(v1::COMMAND_STATE_ABORTED, v1::REASON_SUPERSEDED);
  seen.stopped = true;
  EXPECT_EQ(judge_limit(seen).reason,
            "X2 (negative_limit) became active on the way, not X1 (positive_limit): swapped?");
  seen.became_active = true;
  EXPECT_EQ(judge_limit(seen).reason, "X2 (negative_limit) became active, too");
  seen = limit();
  seen.moving = true;
  EXPECT_EQ(judge_limit(seen).verdict, VERDICT_FAILED);
  seen = limit();
  seen.command = command(v1::COMMAND_STATE_ABORTED, v1::REASON_TERMINAL);
  EXPECT_EQ(judge_limit(seen).reason, "MoveRelative ended Aborted: terminal");
  EXPECT_EQ(judge_limit(seen).remedy, "was X1 released too early?");
  seen.command = command(v1::COMMAND_STATE_ERROR, v1::REASON_DID_NOT_START);
  EXPECT_EQ(judge_limit(seen).remedy, "let it move before the switch is actuated");
}

TEST(JudgeLimit, OnlyAnotherLimitSwitchIsInItsPlace) {
  EXPECT_EQ(limit_instead(edge("X2", true, "negative_limit"), "X1"), "X2 (negative_limit)");
  EXPECT_EQ(limit_instead(edge("X2", false, "negative_limit"), "X1"), "");
  EXPECT_EQ(limit_instead(edge("X1", true, "positive_limit"), "X1"), "");
  EXPECT_EQ(limit_instead(edge("X0", true, "home"), "X1"), "") << "passed on the way";
  EXPECT_EQ(limit_instead(edge("X3", true), "X1"), "");
}

TEST(JudgeLimit, FailsWhereTheDirectionIsNotForbidden) {
  auto seen = limit();
  seen.further = obstacle(v1::REASON_LIMIT_SWITCH, false);
  EXPECT_EQ(judge_limit(seen).verdict, VERDICT_FAILED);
}

TEST(JudgeLimit, NeedsTheWayBack) {
  auto seen = limit();
  seen.away = command(v1::COMMAND_STATE_ERROR, v1::REASON_DID_NOT_START);
  EXPECT_EQ(judge_limit(seen).reason, "motion away from it: MoveRelative ended Error: did not start");
  seen.away.reset();
  seen.away_left_out = "no time";
  EXPECT_EQ(judge_limit(seen).verdict, VERDICT_SKIPPED);
}

StopObservation stop() {
  return {.move = command(v1::COMMAND_STATE_ABORTED, v1::REASON_SUPERSEDED),
          .stop = command(v1::COMMAND_STATE_DONE),
          .unit = "mm",
          .time = 0.2,
          .bound = 0.3,
          .way = 1,
          .way_bound = 1.5,
          .held = true,
          .while_held = obstacle(v1::REASON_STOPPING),
          .released = true};
}

TEST(JudgeStop, PassesWithinItsBounds) { EXPECT_EQ(judge_stop(stop()).verdict, VERDICT_PASSED); }

TEST(JudgeStop, FailsForEachReason) {
  const auto reason_after = [](auto change) {
    auto seen = stop();
    change(seen);
    const auto judgement = judge_stop(seen);
    EXPECT_EQ(judgement.verdict, VERDICT_FAILED);
    return judgement.reason;
  };
  EXPECT_THAT(
      reason_after([](auto& s) { s.stop = command(v1::COMMAND_STATE_ERROR, v1::REASON_NOT_CONFIRMED); }),
      HasSubstr("standstill is not confirmed"));
  EXPECT_EQ(reason_after([](auto& s) { s.moving = true; }), "it still moves");
  EXPECT_THAT(reason_after([](auto& s) { s.move = command(v1::COMMAND_STATE_DONE); }),
              HasSubstr("the move was over before the stop"));
  EXPECT_THAT(reason_after([](auto& s) { s.at_target = true; }), HasSubstr("went on to its target"));
  EXPECT_EQ(reason_after([](auto& s) { s.time = 0.31; }), "standstill after 310 ms, published bound 300 ms");
  EXPECT_THAT(reason_after([](auto& s) { s.way = 2; }), HasSubstr("2 mm until it rested"));
  EXPECT_THAT(reason_after([](auto& s) { s.held = false; }), HasSubstr("not held"));
  EXPECT_THAT(reason_after([](auto& s) { s.while_held.Clear(); }), HasSubstr("not held"));
  EXPECT_THAT(reason_after([](auto& s) { s.released = false; }), HasSubstr("not at Standstill"));
}

TEST(JudgeJog, NamesTheKeyOfADriveThatTakesNoStartInOneFrame) {
  for (const auto cause : {v1::REASON_DID_NOT_START, v1::REASON_REFUSED}) {
    JogObservation jog{.axis = "feeder", .command = command(v1::COMMAND_STATE_ERROR, cause), .distance = 5};
    EXPECT_THAT(judge_motion(jog, "mm").remedy, Not(HasSubstr("start_in_one_frame")));
    jog.in_one_frame = true;
    const auto judgement = judge_motion(jog, "mm");
    EXPECT_EQ(judgement.verdict, VERDICT_FAILED);
    EXPECT_THAT(judgement.reason, HasSubstr("does not start in one frame"));
    EXPECT_THAT(judgement.remedy, HasSubstr("remove axes.feeder.drive.start_in_one_frame"));
  }
}

TEST(JudgeSoftLimits, NeedsBothRefused) {
  const auto refused = obstacle(v1::REASON_SOFT_LIMIT);
  EXPECT_EQ(judge_soft_limits(refused, refused).verdict, VERDICT_PASSED);
  EXPECT_EQ(judge_soft_limits(refused, {}).reason, "a target below the soft limits is not refused");
  EXPECT_EQ(judge_soft_limits({}, refused).reason, "a target above the soft limits is not refused");
  EXPECT_EQ(judge_soft_limits(obstacle(v1::REASON_NOT_TRUSTED), refused).verdict, VERDICT_NOT_DONE);
}

TEST(JudgeHoming, NeedsAPositionThatIsHomed) {
  v1::AxisState state;
  state.set_trust(v1::POSITION_TRUST_HOMED);
  EXPECT_EQ(judge_homing(command(v1::COMMAND_STATE_DONE), state).verdict, VERDICT_PASSED);
  EXPECT_EQ(judge_homing(command(v1::COMMAND_STATE_ERROR), state).verdict, VERDICT_FAILED);
  state.set_trust(v1::POSITION_TRUST_UNKNOWN);
  EXPECT_EQ(judge_homing(command(v1::COMMAND_STATE_DONE), state).verdict, VERDICT_FAILED);
}

google::protobuf::Timestamp at(std::int64_t seconds, int milliseconds) {
  google::protobuf::Timestamp time;
  time.set_seconds(seconds);
  time.set_nanos(milliseconds * 1'000'000);
  return time;
}

v1::AxisState sample(int milliseconds, double position) {
  v1::AxisState state;
  *state.mutable_measured_at() = at(1000, milliseconds);
  state.set_position(position);
  state.set_velocity(-100);
  return state;
}

TEST(WaySince, LiesBetweenTheSamples) {
  const std::vector<v1::AxisState> samples{sample(0, 0), sample(100, -10), sample(200, -18)};
  EXPECT_NEAR(way_since(at(1000, 50), samples, -20), 15, 1e-5);
  // Beyond the last sample it went on at its velocity; before the first nothing is known.
  EXPECT_NEAR(way_since(at(1000, 210), samples, -20), 1, 1e-5);
  EXPECT_NEAR(way_since(at(999, 0), samples, -20), 20, 1e-5);
}

}  // namespace
}  // namespace axisd::axisctl::commission
