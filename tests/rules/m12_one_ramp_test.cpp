// M12 on a CiA 402 drive without 6084h, which brakes as it accelerates, or with one that is only read.
#include <gtest/gtest.h>

#include "tests/rules/model_rig.hpp"
#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

TEST(M12, WithoutADecelerationOfItsOwnTheDriveBrakesAsItAccelerates) {
  ModelRig rig({.model = "cia402", .limits = false, .drive_keys = "objects: { 6084h: { access: none } }"});
  const auto done = [&rig](const Action& action) {
    auto command = rig.complete(action);
    EXPECT_EQ(command.state, CommandState::done) << describe(command);
    return command;
  };
  const auto untouched = rig.drive->peek(0x608400);
  done(EnableRequest{});
  done(SetPositionRequest{.position = 100});
  const auto move = done(MoveRelativeRequest{.distance = 20, .with = {.acceleration_time = 250ms}});
  EXPECT_EQ(move.granted.deceleration_time, std::optional<Duration>(250ms));
  const auto refused = rig.try_submit(
      MoveRelativeRequest{.distance = 1, .with = {.acceleration_time = 250ms, .deceleration_time = 100ms}});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, Reason::not_supported) << to_string(refused.error());
  for (const Action& action :
       {Action(MoveRelativeRequest{.distance = 200, .with = {.acceleration_time = 300ms}}),
        Action(MoveVelocityRequest{.velocity = -50, .with = {.acceleration_time = 300ms}})}) {
    ASSERT_TRUE(rig.try_submit(action));
    rig.run(800ms);
    EXPECT_TRUE(rig.moving());
    EXPECT_EQ(done(StopRequest{}).granted.deceleration_time, std::optional<Duration>(300ms));
    EXPECT_FALSE(rig.moving());
  }
  EXPECT_EQ(rig.drive->peek(0x608400), untouched) << "it was never written";
}

/// 6084h = 5000: from 100 mm/s it brakes for 2 s, whatever it is told.
TEST(M12, ADecelerationThatCannotBeSetIsInPredictionsAndBounds) {
  ModelRig rig({.model = "cia402",
                .limits = false,
                .drive_keys = "objects: { 6084h: { access: ro, default: 5000 } }"});
  rig.drive->poke(0x608400, 5000);
  const auto done = [&rig](const Action& action) {
    auto command = rig.complete(action);
    EXPECT_EQ(command.state, CommandState::done) << describe(command);
    return command;
  };
  done(EnableRequest{});
  done(SetPositionRequest{.position = 0});
  for (const double distance : {300.0, 5.0, -280.0}) {
    const auto move = done(MoveRelativeRequest{.distance = distance, .with = {.acceleration_time = 150ms}});
    EXPECT_EQ(move.granted.acceleration_time, std::optional<Duration>(150ms));
    EXPECT_EQ(move.granted.deceleration_time, std::optional<Duration>(2s));
  }
  for (const auto& with : {MotionValues{.deceleration_time = 1s},
                           MotionValues{.acceleration_time = 1s, .deceleration_time = 1s}}) {
    const auto refused = rig.try_submit(MoveRelativeRequest{.distance = 1, .with = with});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().reason, Reason::not_supported) << to_string(refused.error());
  }
  for (const Action& action :
       {Action(MoveRelativeRequest{.distance = 400}), Action(MoveVelocityRequest{.velocity = -100})}) {
    ASSERT_TRUE(rig.try_submit(action));
    rig.run(1s);
    EXPECT_TRUE(rig.moving());
    EXPECT_EQ(done(StopRequest{}).granted.deceleration_time, std::optional<Duration>(2s));
    EXPECT_FALSE(rig.moving());
  }
  EXPECT_EQ(rig.drive->peek(0x608400), 5000U) << "it was never written";
}

/// 6084h = 2500: 4 s, also for a stop of which nobody knows what it ends (M4).
TEST(M12, ADecelerationThatCannotBeSetIsInTheBoundOfADriveFoundMoving) {
  ModelRig rig({.model = "cia402",
                .limits = false,
                .drive_keys = "objects: { 6084h: { access: ro, default: 2500 } }"});
  rig.drive->poke(0x608400, 2500);
  for (const Action& action : {Action(EnableRequest{}), Action(SetPositionRequest{.position = 0})})
    EXPECT_EQ(rig.complete(action).state, CommandState::done);
  ASSERT_TRUE(rig.try_submit(MoveVelocityRequest{.velocity = 100}));
  rig.run(600ms);
  rig.stop_daemon();
  ASSERT_TRUE(rig.moving()) << "the end of the daemon stops nothing";
  const auto before = rig.load_mm();
  rig.start_daemon();
  EXPECT_TRUE(rig.run_until([&] { return !rig.moving(); }, 10s));
  EXPECT_GT(rig.load_mm() - before, 195) << "braked harder than it brakes by itself";
  EXPECT_EQ(rig.drive->peek(0x605D00) & 0xFFU, 1U) << "no quick stop";
}

}  // namespace
}  // namespace axisd::test
