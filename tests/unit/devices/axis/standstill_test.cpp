#include "devices/axis/standstill.hpp"

#include <gtest/gtest.h>

namespace axisd {
namespace {

using namespace std::chrono_literals;

constexpr TimePoint stopped{10s};
constexpr auto deadline = stopped + 500ms;

DriveSample sample(TimePoint asked, bool moving, DriveMode mode = DriveMode::positioning) {
  return {.asked_at = asked, .measured_at = asked + 2ms, .mode = mode, .moving = moving};
}

/// Readings of a watch, by the time since the stop.
struct Polled {
  RestVerdict operator()(Duration at, bool moving, std::int64_t counter = 0,
                         DriveMode mode = DriveMode::positioning) {
    return watch.look(sample(stopped + at, moving, mode), counter, 1);
  }
  StandstillWatch watch{stopped, deadline};
};

TEST(StandstillWatch, WhatWasReadBeforeTheStopCountsForNothing) {
  Polled look;
  EXPECT_EQ(look(-1ms, false), RestVerdict::undecided);
  EXPECT_EQ(look(0ms, false), RestVerdict::rests);
}

TEST(StandstillWatch, OneReadingAtRestIsEnough) {
  Polled look;
  EXPECT_EQ(look(10ms, true), RestVerdict::undecided);
  EXPECT_EQ(look(20ms, false), RestVerdict::rests);
}

TEST(StandstillWatch, WithinHomingItHasToRestAtOnePlaceForAWhile) {
  Polled look;
  using enum DriveMode;
  EXPECT_EQ(look(10ms, false, 100, homing), RestVerdict::undecided);
  EXPECT_EQ(look.watch.state(), StandstillWatch::State::resting);
  EXPECT_EQ(look(150ms, false, 101, homing), RestVerdict::undecided) << "not long enough";
  EXPECT_EQ(look(160ms, false, 99, homing), RestVerdict::rests);
}

TEST(StandstillWatch, RestElsewhereBeginsAnew) {
  Polled look;
  using enum DriveMode;
  EXPECT_EQ(look(10ms, false, 100, homing), RestVerdict::undecided);
  EXPECT_EQ(look(100ms, false, 102, homing), RestVerdict::undecided);
  EXPECT_EQ(look(200ms, false, 102, homing), RestVerdict::undecided);
  EXPECT_EQ(look(250ms, false, 102, homing), RestVerdict::rests);
}

TEST(StandstillWatch, AMotionBetweenTwoRestsBeginsAnew) {
  Polled look;
  using enum DriveMode;
  EXPECT_EQ(look(10ms, false, 100, homing), RestVerdict::undecided);
  EXPECT_EQ(look(100ms, true, 100, homing), RestVerdict::undecided);
  EXPECT_EQ(look.watch.state(), StandstillWatch::State::moving);
  EXPECT_EQ(look(170ms, false, 100, homing), RestVerdict::undecided);
}

TEST(StandstillWatch, OnlyAReadingFromAfterTheDeadlineShowsThatItMovesOn) {
  Polled look;
  EXPECT_EQ(look(499ms, true), RestVerdict::undecided);
  EXPECT_EQ(look(500ms, true), RestVerdict::moves);
}

TEST(StandstillWatch, WhatRestsWithinHomingAtTheDeadlineGetsItsTime) {
  Polled look;
  using enum DriveMode;
  EXPECT_EQ(look(499ms, false, 100, homing), RestVerdict::undecided);
  EXPECT_EQ(look(600ms, false, 100, homing), RestVerdict::undecided);
  EXPECT_EQ(look(649ms, false, 100, homing), RestVerdict::rests);
  Polled other;
  EXPECT_EQ(other(640ms, false, 100, homing), RestVerdict::undecided);
  EXPECT_EQ(other(650ms, false, 200, homing), RestVerdict::moves);
}

struct Unpolled {
  RestVerdict operator()(Duration at, bool moving, std::int64_t counter = 0,
                         DriveMode mode = DriveMode::positioning) {
    return watch.look(sample(stopped + at, moving, mode), counter, 1);
  }
  UnpolledStandstill watch{deadline};
};

TEST(UnpolledStandstill, OneReadingAtRestIsEnough) {
  Unpolled look;
  EXPECT_EQ(look(10ms, true), RestVerdict::undecided);
  EXPECT_EQ(look(20ms, false), RestVerdict::rests);
}

TEST(UnpolledStandstill, WithinHomingItHasToRestAtOnePlaceForSeveralReadings) {
  Unpolled look;
  for (int reading = 1; reading < UnpolledStandstill::resting_in_homing; ++reading)
    EXPECT_EQ(look(10ms * reading, false, 100, DriveMode::homing), RestVerdict::undecided);
  EXPECT_EQ(look(100ms, false, 101, DriveMode::homing), RestVerdict::rests);
}

TEST(UnpolledStandstill, RestElsewhereBeginsAnew) {
  Unpolled look;
  for (int reading = 1; reading < UnpolledStandstill::resting_in_homing; ++reading)
    EXPECT_EQ(look(10ms * reading, false, 100, DriveMode::homing), RestVerdict::undecided);
  EXPECT_EQ(look(100ms, false, 200, DriveMode::homing), RestVerdict::undecided);
  for (int reading = 1; reading < UnpolledStandstill::resting_in_homing; ++reading)
    EXPECT_EQ(look(100ms + 10ms * reading, false, 200, DriveMode::homing), RestVerdict::undecided);
  EXPECT_EQ(look(200ms, false, 200, DriveMode::homing), RestVerdict::rests);
}

TEST(UnpolledStandstill, OnlyAReadingFromAfterTheDeadlineShowsThatItMovesOn) {
  Unpolled look;
  EXPECT_EQ(look(499ms, true), RestVerdict::undecided);
  EXPECT_EQ(look(500ms, true), RestVerdict::moves);
  Unpolled other;
  EXPECT_EQ(other(600ms, false, 100, DriveMode::homing), RestVerdict::undecided) << "it rests at the moment";
}

TEST(UnpolledStandstill, SeveralRepliesInARowThatDoNotComeEndIt) {
  Unpolled look;
  EXPECT_EQ(look.watch.silence(), RestVerdict::undecided);
  EXPECT_EQ(look.watch.silence(), RestVerdict::undecided);
  EXPECT_EQ(look(10ms, true), RestVerdict::undecided);
  EXPECT_EQ(look.watch.silence(), RestVerdict::undecided);
  EXPECT_EQ(look.watch.silence(), RestVerdict::undecided);
  EXPECT_EQ(look.watch.silence(), RestVerdict::moves);
}

}  // namespace
}  // namespace axisd
