#include "devices/cia402/motion_watch.hpp"

#include <gtest/gtest.h>

namespace axisd::cia402 {
namespace {

using namespace std::chrono_literals;
using State = MotionWatch::State;

constexpr TimePoint start{1h};

class Motion : public testing::Test {
 protected:
  /// By the drive's own word.
  DriveSample take(Duration after, std::int32_t position, bool moving, int rpm = 0) {
    DriveSample sample;
    sample.asked_at = start + after;
    sample.position_pulses = position;
    sample.moving = moving;
    sample.velocity_rpm = rpm;
    sample.negative_direction = rpm < 0;
    watch_.take(sample, {.gauge = {.window = 10, .pulses_per_revolution = 1000}});
    return sample;
  }

  MotionWatch watch_;
};

TEST_F(Motion, ATriggerBeginsAndAReadingShowsIt) {
  EXPECT_EQ(watch_.state(), State::rest);
  watch_.begin(start);
  EXPECT_EQ(watch_.state(), State::begun);
  take(10ms, 0, true, 100);
  EXPECT_EQ(watch_.state(), State::seen);
  take(20ms, 50, false);
  EXPECT_EQ(watch_.state(), State::rest);
}

TEST_F(Motion, AReadingOfBeforeTheTriggerEndsNothing) {
  watch_.begin(start + 10ms);
  take(5ms, 0, true, 100);
  EXPECT_EQ(watch_.state(), State::begun);
}

TEST_F(Motion, WhatDoesNotShowInTimeDidNotStart) {
  watch_.begin(start);
  take(499ms, 0, false);
  EXPECT_EQ(watch_.state(), State::begun);
  take(500ms, 0, false);
  EXPECT_EQ(watch_.state(), State::rest);
}

/// Whoever looks for a motion that has begun must not take a doubt about rest for one.
TEST_F(Motion, WhatOnlyHasToShowItsRestMovesWithoutAVelocity) {
  const auto by_way = [this](Duration after, std::int32_t position, int rpm) {
    DriveSample sample{.asked_at = start + after, .position_pulses = position, .velocity_rpm = rpm};
    watch_.take(sample, {.by_way = true, .gauge = {.window = 10, .pulses_per_revolution = 1000}});
    return sample;
  };
  EXPECT_FALSE(by_way(0ms, 0, 0).moving);
  watch_.begin(start);
  watch_.stop(false);
  EXPECT_TRUE(by_way(20ms, 1, 1).moving);
  EXPECT_EQ(by_way(30ms, 1, 1).velocity_rpm, 0);
  EXPECT_TRUE(by_way(40ms, 10, 1).moving);
  EXPECT_EQ(by_way(50ms, 12, 1).velocity_rpm, 1) << "its way shows it";
}

/// The motion before has just ended: what is left of its ringing is not the one that has begun.
TEST_F(Motion, WhatSettlesWhileItsRestIsDoubtedMovesWithoutAVelocity) {
  const auto settling = [this](Duration after, std::int32_t position, int rpm) {
    DriveSample sample{.asked_at = start + after, .position_pulses = position, .velocity_rpm = rpm};
    watch_.take(sample,
                {.by_way = true, .told = false, .gauge = {.window = 10, .pulses_per_revolution = 1000}});
    return sample;
  };
  EXPECT_FALSE(settling(0ms, 0, 0).moving);
  watch_.begin(start);
  watch_.stop(false);
  const auto left = settling(20ms, 3, 3);
  EXPECT_TRUE(left.moving);
  EXPECT_EQ(left.velocity_rpm, 0);
  EXPECT_EQ(settling(30ms, 6, 3).velocity_rpm, 3) << "its way shows it";
}

TEST_F(Motion, AStopEndsIt) {
  watch_.begin(start);
  watch_.stop(false);
  EXPECT_EQ(watch_.state(), State::rest);
  EXPECT_FALSE(watch_.moves());
}

TEST_F(Motion, APowerCycleForgetsTheLastReading) {
  watch_.begin(start);
  take(10ms, 700, true, 100);
  EXPECT_EQ(watch_.position(), 700);
  watch_.forget();
  EXPECT_EQ(watch_.state(), State::rest);
  EXPECT_FALSE(watch_.position());
  EXPECT_FALSE(watch_.moves());
}

TEST_F(Motion, TheDirectionIsThatOfTheTargetUntilTheWayTellsAnother) {
  watch_.turns(true);
  EXPECT_TRUE(take(0ms, 100, false).negative_direction);
  EXPECT_TRUE(take(10ms, 105, false).negative_direction) << "half of the window is no way";
  EXPECT_FALSE(take(20ms, 106, false).negative_direction);
}

TEST_F(Motion, WithoutAWayTheVelocityTellsTheDirection) {
  EXPECT_TRUE(take(0ms, 100, true, -50).negative_direction);
  EXPECT_FALSE(take(10ms, 100, true, 50).negative_direction);
}

TEST_F(Motion, ACounterThatJumpedIsNoWay) {
  take(0ms, 5000, false);
  watch_.counter_jumped();
  EXPECT_FALSE(take(10ms, 0, false).negative_direction);
}

TEST_F(Motion, ACounterThatJumpedIsNoMotion) {
  DriveSample sample;
  const auto look = [&](Duration after, std::int32_t position) {
    sample = {};
    sample.asked_at = start + after;
    sample.position_pulses = position;
    watch_.take(sample, {.by_way = true, .gauge = {.window = 10, .pulses_per_revolution = 1000}});
    return sample.moving;
  };
  for (int i = 0; i < 50; ++i) (void)look(i * 20ms, 5000);
  watch_.counter_jumped();
  EXPECT_FALSE(look(1000ms, 0));
}

TEST_F(Motion, WhereTheWayTellsNoiseIsNoVelocity) {
  DriveSample sample;
  for (int i = 0; i < 50; ++i) {
    sample = {};
    sample.asked_at = start + i * 20ms;
    sample.position_pulses = i % 2;
    sample.moving = true;
    sample.velocity_rpm = i % 2;
    watch_.take(sample, {.by_way = true, .gauge = {.window = 10, .pulses_per_revolution = 1000}});
  }
  EXPECT_FALSE(sample.moving);
  EXPECT_EQ(sample.velocity_rpm, 0);
}

TEST_F(Motion, AfterAStopRestHasToBeShownAnew) {
  const auto look = [this](Duration after) {
    DriveSample sample;
    sample.asked_at = start + after;
    watch_.take(sample, {.by_way = true, .gauge = {.window = 10, .pulses_per_revolution = 1000}});
    return sample.moving;
  };
  for (int i = 0; i < 50; ++i) (void)look(i * 20ms);
  ASSERT_FALSE(look(1000ms));
  watch_.stop(false);
  EXPECT_FALSE(look(1020ms)) << "nothing was begun";
  watch_.stop(true);
  EXPECT_TRUE(look(1040ms));
  for (int i = 0; i < 50; ++i) (void)look(1060ms + i * 20ms);
  ASSERT_FALSE(look(2060ms));
  watch_.begin(start + 2070ms);
  watch_.stop(false);
  EXPECT_TRUE(look(2080ms)) << "what was begun may turn slowly";
}

}  // namespace
}  // namespace axisd::cia402
