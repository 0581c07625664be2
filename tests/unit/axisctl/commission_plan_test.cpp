#include <gmock/gmock.h>

#include "api/axisctl/commission/plan.hpp"
#include "api/axisctl/commission/record.hpp"

namespace axisd::axisctl::commission {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr const char* yaml = R"(
machine: press-1
buses:
  line: { modbus_rtu: { port: sim, baud: 115200, format: 8N1 } }
axes:
  feeder:
    bus: line
    node: 1
    model: ykd2405pr
    unit: mm
    scale: { microstep: 10000 pulses/rev, travel: 5 mm/rev, invert: true }
    limits: { position: [0, 400], velocity: 100 mm/s, acceleration_time: 150 ms, deceleration_time: 250 ms }
    homing: { method: home_negative, velocity: 20 mm/s, search_velocity: 2 mm/s, max_travel: 450 mm, timeout: 60 s }
    inputs: { X0: home, X1: { function: positive_limit, active: low } }
    jog_travel: 20 mm
    load: vertical
)";

Settings settings() { return settings_of(yaml, "axisd.yaml", "feeder").settings.value(); }

v1::AxisState state() {
  v1::AxisState state;
  state.set_axis("feeder");
  const auto add = [&](const char* name, const char* function) {
    auto& input = *state.add_inputs();
    input.set_name(name);
    input.set_function(function);
  };
  add("X0", "home");
  add("X1", "positive_limit");
  add("X2", "");
  return state;
}

TEST(Settings, AreThoseOfTheFile) {
  const auto read = settings_of(yaml, "axisd.yaml", "feeder");
  ASSERT_TRUE(read.settings.has_value()) << read.why_not;
  const auto& one = *read.settings;
  EXPECT_EQ(one.position_maximum, 400);
  EXPECT_EQ(one.velocity, 100);
  EXPECT_DOUBLE_EQ(one.deceleration_time, 0.25);
  EXPECT_DOUBLE_EQ(with_braking(one, 2.5).deceleration_time, 2.5) << "the drive's own";
  EXPECT_DOUBLE_EQ(with_braking(one, 0).deceleration_time, 0.25) << "nothing is published";
  EXPECT_TRUE(one.invert && one.vertical);
  EXPECT_EQ(one.homing_method, "home_negative");
  EXPECT_TRUE(one.may_start_in_one_frame);
  EXPECT_FALSE(one.starts_in_one_frame);
  ASSERT_EQ(one.inputs.size(), 2U);
  EXPECT_EQ(one.inputs[0].active(), "high");
  EXPECT_EQ(one.inputs[1].active(), "low");
}

TEST(Settings, SayWhetherStartsGoInOneFrame) {
  const auto with = [](const std::string& lines) {
    return settings_of(yaml + lines, "axisd.yaml", "feeder").settings.value();
  };
  const std::string key = "    drive: { start_in_one_frame: true }\n";
  EXPECT_TRUE(with(key).starts_in_one_frame);
  auto text = yaml + key;
  text.replace(text.find("X0: home,"), 9, "X0: home, X2: jog_positive,");
  const auto started = settings_of(text, "axisd.yaml", "feeder").settings.value();
  EXPECT_FALSE(started.may_start_in_one_frame) << "a terminal may start it";
  EXPECT_FALSE(started.starts_in_one_frame);
}

TEST(Plan, HasAStartInOneFrameWhereTheConfigurationDoes) {
  const auto reason = [](const std::optional<Settings>& with) {
    const auto steps = plan_steps(state(), with);
    return std::ranges::find(steps, StepKind::one_frame, &StepPlan::kind)->not_applicable;
  };
  auto one = settings();
  EXPECT_THAT(reason(one), HasSubstr("axes.feeder.drive.start_in_one_frame is false"));
  one.starts_in_one_frame = true;
  EXPECT_EQ(reason(one), "");
  EXPECT_NE(reason(std::nullopt), "");
  one.may_start_in_one_frame = false;
  EXPECT_THAT(reason(one), HasSubstr("more than one frame"));
}

TEST(Settings, SayWhyThereAreNone) {
  EXPECT_THAT(settings_of("machine: [", "there.yaml", "feeder").why_not, HasSubstr("there.yaml"));
  EXPECT_THAT(settings_of(yaml, "there.yaml", "lifter").why_not, HasSubstr("no axis lifter"));
}

TEST(Plan, HasHandsBeforePowerAndPowerOffAtTheEnd) {
  std::vector<std::string> names;
  std::vector<std::string> applicable;
  for (const auto& step : plan_steps(state(), settings())) {
    names.push_back(step.name);
    if (step.not_applicable.empty()) applicable.push_back(step.name);
  }
  EXPECT_THAT(names, ElementsAre("identity", "power off", "switch X0", "switch X1", "power on",
                                 "jog positive", "jog negative", "start in one frame", "limit positive",
                                 "limit negative", "stop", "homing", "soft limits", "power off again"));
  EXPECT_THAT(applicable,
              ElementsAre("identity", "switch X0", "switch X1", "power on", "jog positive", "jog negative",
                          "limit positive", "stop", "homing", "soft limits", "power off again"));
}

TEST(Plan, LeavesOutWhatIsNotConfigured) {
  v1::AxisState bare;
  bare.set_enabled(true);
  for (const auto& step : plan_steps(bare, std::nullopt)) {
    const bool there = step.kind == StepKind::identity || step.kind == StepKind::release ||
                       step.kind == StepKind::enable || step.kind == StepKind::jog ||
                       step.kind == StepKind::stop || step.kind == StepKind::disable;
    EXPECT_EQ(step.not_applicable.empty(), there) << step.name;
  }
}

/// A record in which everything passed.
struct Rehearsal {
  std::vector<StepPlan> steps = plan_steps(state(), settings());
  Record record;

  Rehearsal() {
    record.set_speed(SPEED_PROOF_PROVEN);
    for (const auto& plan : steps) {
      auto& step = *record.add_steps();
      step.set_name(plan.name);
      step.set_verdict(VERDICT_PASSED);
    }
  }
  void set(const std::string& name, Verdict verdict) {
    for (auto& step : *record.mutable_steps())
      if (step.name() == name) step.set_verdict(verdict);
  }
  /// Names of the steps that must not be done.
  [[nodiscard]] std::vector<std::string> forbidden() const {
    std::vector<std::string> names;
    for (const auto& step : steps)
      if (!obstacle(step, steps, record).empty()) names.push_back(step.name);
    return names;
  }
};

TEST(Obstacle, IsNoneWhereAllPassed) { EXPECT_THAT(Rehearsal().forbidden(), IsEmpty()); }

TEST(Obstacle, IsAnAxisThatCannotBeCommanded) {
  Rehearsal rehearsal;
  rehearsal.set("identity", VERDICT_SKIPPED);
  EXPECT_EQ(rehearsal.forbidden().size(), rehearsal.steps.size() - 1);
}

TEST(Obstacle, IsPowerForHandsAndNoPowerForMotion) {
  Rehearsal rehearsal;
  rehearsal.set("power off", VERDICT_SKIPPED);
  EXPECT_THAT(rehearsal.forbidden(), ElementsAre("switch X0", "switch X1"));
  rehearsal = {};
  rehearsal.set("power on", VERDICT_SKIPPED);
  EXPECT_THAT(rehearsal.forbidden(), ElementsAre("jog positive", "jog negative", "limit positive",
                                                 "limit negative", "stop", "homing"));
}

TEST(Obstacle, IsADirectionThatIsWrongOrNotProven) {
  Rehearsal rehearsal;
  rehearsal.set("jog negative", VERDICT_FAILED);
  EXPECT_THAT(rehearsal.forbidden(), ElementsAre("limit positive", "limit negative", "stop", "homing"));
  rehearsal.set("jog negative", VERDICT_SKIPPED);
  EXPECT_THAT(rehearsal.forbidden(), IsEmpty());
  rehearsal.set("jog positive", VERDICT_SKIPPED);
  EXPECT_THAT(rehearsal.forbidden(),
              ElementsAre("start in one frame", "limit positive", "limit negative", "stop", "homing"));
}

TEST(Obstacle, IsASpeedThatIsWrongOrNotProven) {
  Rehearsal rehearsal;
  rehearsal.record.set_speed(SPEED_PROOF_UNSPECIFIED);
  EXPECT_THAT(rehearsal.forbidden(), ElementsAre("limit positive", "limit negative", "stop", "homing"));
  rehearsal.record.set_speed(SPEED_PROOF_WRONG);
  EXPECT_THAT(rehearsal.forbidden(), ElementsAre("jog positive", "jog negative", "limit positive",
                                                 "limit negative", "stop", "homing"));
}

TEST(Obstacle, IsASwitchThatDoesNotWork) {
  Rehearsal rehearsal;
  rehearsal.set("switch X1", VERDICT_FAILED);
  EXPECT_THAT(rehearsal.forbidden(), ElementsAre("limit positive", "limit negative", "stop", "homing"));
  rehearsal = {};
  for (const auto* step : {"switch X0", "limit positive", "stop"}) {
    rehearsal = {};
    rehearsal.set(step, VERDICT_FAILED);
    EXPECT_THAT(rehearsal.forbidden(), ElementsAre("homing")) << step;
  }
}

constexpr VelocityRange permitted{.minimum = 0.5, .maximum = 100};

TEST(Motion, IsSlowAndShort) {
  const auto motion = default_motion(permitted, settings(), {}, {});
  EXPECT_DOUBLE_EQ(motion.velocity, 5);
  EXPECT_DOUBLE_EQ(motion.distance, 10);
  auto narrow = settings();
  narrow.position_maximum = 40;
  EXPECT_DOUBLE_EQ(default_motion(permitted, narrow, {}, {}).distance, 2);
  EXPECT_DOUBLE_EQ(default_motion({.minimum = 8, .maximum = 100}, std::nullopt, {}, {}).velocity, 8);
  const auto asked = default_motion(permitted, settings(), 20, 30);
  EXPECT_DOUBLE_EQ(asked.velocity, 20);
  EXPECT_DOUBLE_EQ(asked.distance, 30);
}

TEST(Motion, ThatProvesTheSpeedIsATenthOfTheHighestAndLastsASecond) {
  EXPECT_DOUBLE_EQ(proving_velocity(permitted, 5, 10), 5) << "nothing is faster than what is not proven yet";
  EXPECT_DOUBLE_EQ(proving_velocity(permitted, 5, 4), 4);
  EXPECT_DOUBLE_EQ(proving_velocity(permitted, 20, 10), 10);
  EXPECT_DOUBLE_EQ(proving_velocity(permitted, 20, 200), 10);
  EXPECT_DOUBLE_EQ(proving_velocity(permitted, 2, 200), 2);
  EXPECT_DOUBLE_EQ(proving_velocity({.minimum = 30, .maximum = 100}, 40, 10), 30);
}

TEST(Motion, IsBoundedByWhatIsKnown) {
  auto at = state();
  at.set_trust(v1::POSITION_TRUST_UNKNOWN);
  EXPECT_EQ(bounded(100, true, at, settings()), 20);
  at.set_trust(v1::POSITION_TRUST_HOMED);
  at.set_position(390);
  EXPECT_EQ(bounded(100, true, at, settings()), 10);
  EXPECT_EQ(bounded(100, false, at, settings()), 100);
  at.set_position(410);
  EXPECT_EQ(bounded(100, true, at, settings()), 0);
  EXPECT_EQ(bounded(100, true, at, std::nullopt), 100);
}

TEST(Motion, GivesAHandTimeToReachTheSwitch) {
  const auto near = limit_motion({.velocity = 5, .distance = 10}, 20, permitted);
  EXPECT_DOUBLE_EQ(near.distance, 20);
  EXPECT_DOUBLE_EQ(near.velocity, 2);
  const auto far = limit_motion({.velocity = 5, .distance = 10}, 1000, permitted);
  EXPECT_DOUBLE_EQ(far.distance, 150);
  EXPECT_DOUBLE_EQ(far.velocity, 5);
  EXPECT_DOUBLE_EQ(limit_motion({.velocity = 5, .distance = 10}, 1, permitted).velocity, 0.5);
}

TEST(Motion, LeavesRoomForAStop) {
  EXPECT_DOUBLE_EQ(stop_distance({.velocity = 5, .distance = 10}, settings()), 14);
  EXPECT_DOUBLE_EQ(stop_distance({.velocity = 5, .distance = 100}, settings()), 100);
  EXPECT_DOUBLE_EQ(duration_of(10, 5, settings()), 2.2);
}

TEST(Motion, IsSlowerWhereThereIsLittleRoomForAStop) {
  const Motion fast{.velocity = 20, .distance = 5};
  EXPECT_DOUBLE_EQ(stop_motion(fast, 1000, permitted, settings()).distance, 56);
  EXPECT_DOUBLE_EQ(stop_motion(fast, 1000, permitted, settings()).velocity, 20);
  const auto near = stop_motion(fast, 14, permitted, settings());
  EXPECT_DOUBLE_EQ(near.distance, 14);
  EXPECT_DOUBLE_EQ(near.velocity, 5);
  EXPECT_DOUBLE_EQ(stop_motion(fast, 0.7, permitted, settings()).velocity, 0.5);
}

TEST(Motion, OfARotaryAxisGoesOnPastATurn) {
  auto rotary = settings();
  rotary.modulo = 360;
  EXPECT_DOUBLE_EQ(unwrapped(2, 358, rotary), 362);
  EXPECT_DOUBLE_EQ(unwrapped(358, 2, rotary), -2);
  EXPECT_DOUBLE_EQ(unwrapped(2, 358, settings()), 2);
}

TEST(Record, PassesOnlyIfNothingIsLeftOut) {
  Rehearsal rehearsal;
  rehearsal.set("homing", VERDICT_NOT_APPLICABLE);
  conclude(rehearsal.record);
  EXPECT_EQ(rehearsal.record.verdict(), VERDICT_PASSED);
  rehearsal.set("stop", VERDICT_SKIPPED);
  conclude(rehearsal.record);
  EXPECT_EQ(rehearsal.record.verdict(), VERDICT_SKIPPED);
  rehearsal.set("jog positive", VERDICT_FAILED);
  rehearsal.set("limit positive", VERDICT_NOT_DONE);
  rehearsal.record.set_ended_early("interrupted");
  conclude(rehearsal.record);
  EXPECT_EQ(rehearsal.record.verdict(), VERDICT_FAILED);
  EXPECT_EQ(rehearsal.record.summary(),
            "interrupted; failed: jog positive; skipped: stop; not done: limit positive");
}

TEST(Record, OfNothingDidNotPass) {
  Record record;
  conclude(record);
  EXPECT_NE(record.verdict(), VERDICT_PASSED);
}

TEST(Record, IsNamedByMachineAxisAndTime) {
  google::protobuf::Timestamp time;
  time.set_seconds(1'767'323'045);
  time.set_nanos(5);
  EXPECT_EQ(default_file("press-1", "feeder", time), "commission-press-1-feeder-20260102T030405Z.json");
}

TEST(Record, TellsFiguresReasonAndRemedy) {
  Record record;
  auto& step = *record.add_steps();
  step.set_name("stop");
  step.set_verdict(VERDICT_FAILED);
  step.set_reason("too late");
  step.set_remedy("look at it");
  add_figure(step, "standstill_after", 0.25, "s");
  EXPECT_THAT(record_table(record).lines(false),
              ElementsAre(HasSubstr("VERDICT"), HasSubstr("failed   too late"), HasSubstr("-> look at it"),
                          HasSubstr("standstill after 250 ms")));
  EXPECT_THAT(record_text(record, true), HasSubstr(R"("verdict":"VERDICT_FAILED")"));
  EXPECT_THAT(record_text(record, true), Not(HasSubstr("\n")));
}

}  // namespace
}  // namespace axisd::axisctl::commission
