// A motion that is far faster than it was told is a fault, on every model; one that is as fast as told never
// is.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "tests/rules/m22_group_rig.hpp"
#include "tests/rules/model_rig.hpp"
#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

/// From the first motion of a shaft that runs 90 times too fast. At 10 mm/s, with ramps of 100 ms and an
/// encoder that is 8 ms late, it is further than possible after 40 ms, though 150 ms before its start may
/// count for it. The next reading shows that, and the one after confirms it: poll_moving (20 ms) apart, and
/// 25 ms more where one is left out as too near, or waits for its SYNC. A reply and a canary take 10 ms each.
constexpr auto noticed_within = 40ms + 2 * (20ms + 25ms) + 2 * 10ms;
/// From there on: the stop frame, and the ramp that the drive was given.
constexpr auto rests_within = 50ms + 100ms;

class Speed : public ::testing::TestWithParam<std::string> {
 protected:
  static void expect(const Command& command, CommandState state) {
    EXPECT_EQ(command.state, state) << describe(command);
  }
  static CommandPtr start(ModelRig& rig, const Action& action) {
    auto command = rig.try_submit(action);
    if (!command) throw std::runtime_error(to_string(command.error()));
    return *command;
  }
  /// Enabled, at 250 mm: 140 mm from any limit, and more from the switches. It has settled.
  static void make_ready(ModelRig& rig) {
    expect(rig.complete(EnableRequest{}), CommandState::done);
    expect(rig.complete(SetPositionRequest{.position = 100}), CommandState::done);
    expect(rig.complete(MoveAbsoluteRequest{.position = 250}), CommandState::done);
    rig.run(1s);
  }
  static void run_at(ModelRig& rig, double factor) {
    rig.touch([&](auto& node) { EXPECT_TRUE(node.run_at(factor)); });
  }
  static void expect_fault(ModelRig& rig, const Command& command) {
    expect(command, CommandState::error);
    ASSERT_TRUE(command.cause);
    EXPECT_EQ(command.cause->reason, Reason::misconfigured) << describe(command);
    EXPECT_NE(command.cause->message.find("r/min"), std::string::npos) << command.cause->message;
    const auto& keys = rig.machine->find("axis")->descriptor().settings;
    const bool has_unit =
        std::ranges::any_of(keys, [](const SettingSpec& each) { return each.key == "velocity_unit"; });
    EXPECT_EQ(command.cause->remedy.find("velocity_unit") != std::string::npos, has_unit)
        << "the key of a model that has none";
    EXPECT_EQ(rig.state()->state, AxisState::error_stop);
    EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
  }
  /// Nothing runs until a reset.
  static void expect_reset(ModelRig& rig) {
    rig.run(3s);
    EXPECT_FALSE(rig.moving());
    const auto refused = rig.try_submit(MoveRelativeRequest{.distance = 1});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().reason, Reason::fault);
    run_at(rig, 1);
    expect(rig.complete(ResetRequest{}), CommandState::done);
    EXPECT_EQ(rig.state()->state, AxisState::standstill);
    expect(rig.complete(MoveRelativeRequest{.distance = 1}), CommandState::done);
  }
  /// Plain and inverted.
  static void each(double factor, const std::function<void(ModelRig&)>& test) {
    for (const bool invert : {false, true}) {
      SCOPED_TRACE(invert ? "inverted" : "plain");
      ModelRig rig({.model = GetParam(), .invert = invert, .free_input = false});
      make_ready(rig);
      run_at(rig, factor);
      test(rig);
    }
  }
};

const Action slow_motions[] = {MoveAbsoluteRequest{.position = 390, .with = {.velocity = 10}},
                               MoveVelocityRequest{.velocity = 10}, MoveVelocityRequest{.velocity = -10},
                               JogRequest{.velocity = 10, .hold = 2s}};

TEST_P(Speed, FarTooFastIsStoppedAndAFault) {
  for (const auto& action : slow_motions)
    each(90, [&](ModelRig& rig) {
      SCOPED_TRACE(to_string(kind_of(action)));
      const auto command = start(rig, action);
      ASSERT_TRUE(rig.run_until([&] { return rig.moving(); }, 2s));
      EXPECT_TRUE(rig.run_until([&] { return command->has_ended(); }, noticed_within));
      EXPECT_TRUE(rig.run_until([&] { return !rig.moving(); }, rests_within));
      ASSERT_TRUE(rig.run_until([&] { return command->has_ended(); }, 5s));
      expect_fault(rig, command->value());
      EXPECT_NE(command->value().cause->message.find("told to turn at 60 r/min (10 mm/s)"), std::string::npos)
          << describe(command->value());
      expect_reset(rig);
    });
}

/// In velocity mode, where nothing ends it.
TEST_P(Speed, FarTooFastWithoutAnEnd) {
  ModelRig rig({.model = GetParam(), .free_input = false, .limits = false});
  make_ready(rig);
  run_at(rig, 90);
  const auto command = start(rig, MoveVelocityRequest{.velocity = 10});
  ASSERT_TRUE(rig.run_until([&] { return rig.moving(); }, 2s));
  EXPECT_TRUE(rig.run_until([&] { return command->has_ended(); }, noticed_within));
  EXPECT_TRUE(rig.run_until([&] { return !rig.moving(); }, rests_within));
  ASSERT_TRUE(rig.run_until([&] { return command->has_ended(); }, 5s));
  expect_fault(rig, command->value());
}

/// It gets ahead by half of its velocity: a revolution a second, of which it needs one and a quarter at most.
TEST_P(Speed, TwiceAsFastIsAFault) {
  for (const double velocity : {20.0, -20.0})
    each(2, [&](ModelRig& rig) {
      const auto command = start(rig, MoveVelocityRequest{.velocity = velocity});
      ASSERT_TRUE(rig.run_until([&] { return command->has_ended(); }, 1700ms));
      expect_fault(rig, command->value());
    });
}

/// Over before two readings could tell.
TEST_P(Speed, AShortMoveIsJudgedByItsWholeWay) {
  for (const double distance : {20.0, -20.0, 12.0})
    each(90, [&](ModelRig& rig) {
      const auto move = rig.complete(MoveRelativeRequest{.distance = distance, .with = {.velocity = 10}});
      expect_fault(rig, move);
    });
}

TEST_P(Speed, HomingThatIsTooFastIsAFault) {
  each(10, [&](ModelRig& rig) {
    const auto home = start(rig, HomeRequest{});
    ASSERT_TRUE(rig.run_until([&] { return home->has_ended(); }, 60s));
    expect_fault(rig, home->value());
    rig.run(3s);
    EXPECT_FALSE(rig.moving());
  });
}

TEST_P(Speed, AsFastAsToldNeverIs) {
  for (const bool invert : {false, true})
    for (const int noise : {0, 1, 2}) {
      SCOPED_TRACE((invert ? "inverted, noise " : "noise ") + std::to_string(noise));
      ModelRig rig({.model = GetParam(), .invert = invert, .noise = noise, .free_input = false});
      make_ready(rig);
      const auto slow = MotionValues{.velocity = 1};
      expect(rig.complete(MoveAbsoluteRequest{.position = 300}), CommandState::done);
      expect(rig.complete(MoveAbsoluteRequest{.position = 100}), CommandState::done);
      expect(rig.complete(MoveRelativeRequest{.distance = 0.01}), CommandState::done);
      expect(rig.complete(MoveRelativeRequest{.distance = 1, .with = slow}), CommandState::done);
      // Slowly, right after a fast one.
      for (const Action& fast : {Action(JogRequest{.velocity = 100, .hold = 300ms}),
                                 Action(MoveVelocityRequest{.velocity = -100})}) {
        start(rig, fast);
        rig.run(500ms);
        expect(rig.complete(StopRequest{.kind = StopKind::halt}), CommandState::done);
        expect(rig.complete(MoveRelativeRequest{.distance = -1, .with = slow}), CommandState::done);
      }
      start(rig, MoveVelocityRequest{.velocity = 100});
      rig.run(500ms);
      expect(rig.complete(StopRequest{.kind = StopKind::quick_stop}), CommandState::done);
      expect(rig.complete(MoveRelativeRequest{.distance = 1, .with = slow}), CommandState::done);
      for (int i = 0; i < 2; ++i) {
        expect(rig.complete(HomeRequest{}), CommandState::done);
        expect(rig.complete(MoveAbsoluteRequest{.position = 20}), CommandState::done);
      }
      EXPECT_EQ(rig.state()->state, AxisState::standstill);
    }
}

/// A shaft that was held by less than the drive puts up with goes on at its own pace.
TEST_P(Speed, CatchingUpIsNoFault) {
  ModelRig rig({.model = GetParam(), .free_input = false});
  if (rig.drive->encoder() == nullptr) GTEST_SKIP() << "what it has lost it does not catch up";
  make_ready(rig);
  for (const auto held : {100ms, 400ms, 900ms}) {
    const auto move = start(rig, MoveRelativeRequest{.distance = 40, .with = {.velocity = 10}});
    rig.run(1s);
    rig.touch([](auto& node) { node.block_shaft(true); });
    rig.run(held);
    rig.touch([](auto& node) { node.block_shaft(false); });
    ASSERT_TRUE(rig.run_until([&] { return move->has_ended(); }, 20s));
    const auto command = move->value();  // some take a shaft that rests so long for stopped
    if (command.cause) EXPECT_NE(command.cause->reason, Reason::misconfigured) << describe(command);
    if (rig.state()->state == AxisState::error_stop) expect(rig.complete(ResetRequest{}), CommandState::done);
    rig.run(1s);
  }
}

INSTANTIATE_TEST_SUITE_P(Motion, Speed, ::testing::ValuesIn(simulated_models()), [](const auto& info) {
  std::string name = info.param;
  std::erase(name, '-');
  return name;
});

/// Readings that come late, one in three of them: the time between is taken at its longest.
TEST(SpeedOnALine, LateReadingsAreNoFault) {
  using simulation::FaultKind;
  for (const std::string model : {"ykd2405pr", "ess42-r"})
    for (const auto late : {5ms, 20ms, 45ms}) {
      SCOPED_TRACE(model + " " + std::to_string(late.count()) + " ms");
      Rig rig({.model = model});
      rig.ready();
      for (int i = 0; i < 12; ++i) {
        for (int k = 0; k < 8; ++k)
          rig.fault({.kind = i % 4 == 3 ? FaultKind::drop_reply : FaultKind::delay_reply,
                     .function = 0x03,
                     .skip = 10 + (3 * k),
                     .delay = late});
        const auto move = rig.complete(MoveAbsoluteRequest{.position = i % 2 == 0 ? 150.0 : 3.0});
        if (move.cause) EXPECT_NE(move.cause->reason, Reason::misconfigured) << describe(move);
        if (late == 5ms) EXPECT_EQ(move.state, CommandState::done) << describe(move);
        rig.faults().clear();
      }
    }
}

TEST(SpeedOfAGroup, AMemberThatIsTooFastStopsAll) {
  GroupRig rig;
  rig.serial(0).run_at(90);
  const auto move = rig.move(GroupRig::to({{"x", 380}, {"y", 380}, {"z", 380}}));
  ASSERT_TRUE(rig.run_until([&] { return ended(move->state()); }, 10s));
  EXPECT_NE(move->state(), CommandState::done);
  EXPECT_EQ(rig.state("x")->state, AxisState::error_stop);
  rig.run(2s);
  EXPECT_TRUE(rig.rests(1s));
  EXPECT_LT(rig.load_mm("y"), 200);
  EXPECT_LT(rig.load_mm("z"), 200);
}

}  // namespace
}  // namespace axisd::test
