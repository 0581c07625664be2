#include "devices/cia402/homing_run.hpp"

#include <gtest/gtest.h>

namespace axisd::cia402 {
namespace {

using namespace std::chrono_literals;
using State = HomingRun::State;

constexpr TimePoint start{1h};

DriveSample sample(Duration after, std::int32_t position, bool moving, bool homed) {
  DriveSample one;
  one.asked_at = one.measured_at = start + after;
  one.position_pulses = position;
  one.enabled = true;
  one.moving = moving;
  one.homed = homed;
  return one;
}

/// Began at 800 pulses, and has moved since.
HomingRun under_way() {
  HomingRun run;
  run.prepare({.window = 10});
  run.begin(start, 800);
  EXPECT_TRUE(run.take(sample(10ms, 400, true, false), {.low = true}));
  return run;
}

TEST(HomingRun, IsIdleAtFirst) {
  HomingRun run;
  EXPECT_EQ(run.state(), State::idle);
  EXPECT_TRUE(run.is_homed(true, false)) << "as the drive says";
  EXPECT_FALSE(run.is_homed(false, false));
}

TEST(HomingRun, ATriggerBeginsIt) {
  auto run = under_way();
  EXPECT_EQ(run.state(), State::homing);
  EXPECT_FALSE(run.is_homed(true, false)) << "its bit may be left from an earlier one";
  EXPECT_FALSE(run.is_homed(true, true)) << "nor does it count that it fell: this one is under way";
}

TEST(HomingRun, AtHomeTheDriveGoesBackToPositionMode) {
  auto run = under_way();
  EXPECT_FALSE(run.take(sample(20ms, 0, false, true), {}));
  EXPECT_EQ(run.state(), State::leaving);
  EXPECT_TRUE(run.is_homed(false, false));
  const auto guard = run.go_back();
  EXPECT_EQ(run.state(), State::idle);
  EXPECT_EQ(may_send(guard, start), Verdict::send);
  EXPECT_TRUE(run.is_homed(false, false));
  run.left();
  EXPECT_EQ(may_send(guard, start), Verdict::send) << "its end takes nothing back";
}

TEST(HomingRun, WhatElseIsBegunEndsTheWayBack) {
  auto run = under_way();
  EXPECT_FALSE(run.take(sample(20ms, 0, false, true), {}));
  run.give_up();
  EXPECT_EQ(run.state(), State::idle);
  run.stop(true);
  EXPECT_EQ(run.state(), State::leaving);
  const auto guard = run.go_back();
  run.give_up();
  EXPECT_EQ(may_send(guard, start), Verdict::superseded);
}

TEST(HomingRun, NothingOfTheWayBackIsSentAfterAStop) {
  auto run = under_way();
  EXPECT_FALSE(run.take(sample(20ms, 0, false, true), {}));
  const auto guard = run.go_back();
  run.stop(false);
  EXPECT_EQ(may_send(guard, start), Verdict::superseded);
}

TEST(HomingRun, InPositionModeThereIsNoWayBack) {
  auto run = under_way();
  run.stop(false);
  EXPECT_EQ(run.state(), State::leaving);
  run.left();
  EXPECT_EQ(run.state(), State::idle);
}

TEST(HomingRun, OneThatIsOverBetweenTwoReadingsIsKnownByItsWay) {
  HomingRun run;
  run.prepare({.window = 10});
  run.begin(start, 800);
  EXPECT_TRUE(run.take(sample(10ms, 0, false, true), {}));
  EXPECT_FALSE(run.take(sample(10ms + HomingWatch::longest_rest, 0, false, true), {}));
  EXPECT_TRUE(run.is_homed(false, false));
}

TEST(HomingRun, OneThatWasSeenToBeginNeedsNoWay) {
  HomingRun run;
  run.prepare({.window = 10});
  run.begin(start, 0);
  EXPECT_TRUE(run.take(sample(10ms, 0, false, true), {}));
  run.note_begun();
  EXPECT_FALSE(run.take(sample(10ms + HomingWatch::longest_rest, 0, false, true), {}));
  EXPECT_TRUE(run.is_homed(false, false)) << "its bit is not left from before";
}

TEST(HomingRun, AStartTakesOverFromWhatWasToBeLeft) {
  HomingRun run;
  run.stop(true);
  run.begin(start, 800);
  EXPECT_EQ(run.state(), State::homing);
  run.forget();
  EXPECT_EQ(run.state(), State::idle);
}

TEST(HomingRun, OneThatFailedLeavesItNotHomed) {
  auto run = under_way();
  EXPECT_TRUE(run.take(sample(20ms, 300, false, false), {.low = true, .failed = true}));
  EXPECT_FALSE(run.take(sample(80ms, 300, false, false), {.low = true, .failed = true}));
  EXPECT_EQ(run.state(), State::leaving);
  EXPECT_FALSE(run.is_homed(true, false));
  EXPECT_TRUE(run.is_homed(true, true)) << "the drive has forgotten it: its word counts again";
}

TEST(HomingRun, AStopEndsIt) {
  auto run = under_way();
  run.stop(false);
  EXPECT_EQ(run.state(), State::leaving);
  EXPECT_FALSE(run.is_homed(true, false));
}

TEST(HomingRun, AStopLeavesTheHomingOfSomebodyElse) {
  HomingRun run;
  run.stop(false);
  EXPECT_EQ(run.state(), State::idle);
  run.stop(true);
  EXPECT_EQ(run.state(), State::leaving);
}

TEST(HomingRun, APowerCycleForgetsAll) {
  auto run = under_way();
  run.forget();
  EXPECT_EQ(run.state(), State::idle);
  EXPECT_TRUE(run.is_homed(true, false));
}

}  // namespace
}  // namespace axisd::cia402
