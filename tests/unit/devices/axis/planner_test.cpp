// What is granted is what is sent, also where a drive counts velocities in coarse units.
#include "devices/axis/planner.hpp"

#include <gtest/gtest.h>

#include "devices/descriptor.hpp"

namespace axisd {
namespace {

using namespace std::chrono_literals;

/// 1000 pulses/rev, at most 5 rev/s (300 r/min), ramps of 500 ms.
class CoarseDrive {
 public:
  explicit CoarseDrive(VelocityCount count, VelocityCount ramps = {}, std::int64_t fixed = 0,
                       bool two_ramps = true) {
    settings_.scale = {.pulses_per_revolution = 1000, .unit = "rev"};
    settings_.limits.velocity = 5;
    settings_.limits.acceleration_time = 500ms;
    settings_.limits.start_speed_rpm = 0;
    descriptor_.capabilities.minimum_start_rpm = 0;
    descriptor_.capabilities.maximum_start_rpm = 0;
    descriptor_.capabilities.velocity_count = count;
    descriptor_.capabilities.acceleration_count = ramps;
    descriptor_.capabilities.fixed_deceleration = fixed;
    descriptor_.capabilities.own_deceleration = two_ramps;
    descriptor_.capabilities.maximum_time_ms = 60'000;
  }
  [[nodiscard]] Plan profile(double rpm, const MotionValues& asked = {}) const {
    return planner_.profile(rpm / 60, asked).value();
  }
  [[nodiscard]] double granted_rpm(double rpm) const { return *profile(rpm).granted.velocity * 60; }
  [[nodiscard]] const Planner& planner() const { return planner_; }

 private:
  AxisSettings settings_;
  DriveDescriptor descriptor_;
  Scale scale_{{.pulses_per_revolution = 1000, .unit = "rev"}};
  Planner planner_{settings_, descriptor_, scale_};
};

TEST(Planner, GrantsWhatIsSentInCoarseCounts) {
  const CoarseDrive tens({.rpm = 10});
  EXPECT_DOUBLE_EQ(tens.granted_rpm(100), 100);
  EXPECT_DOUBLE_EQ(tens.granted_rpm(99), 90);
  EXPECT_DOUBLE_EQ(tens.granted_rpm(59.9), 50) << "never faster";
  const CoarseDrive turns({.rpm = 60});
  EXPECT_DOUBLE_EQ(turns.granted_rpm(300), 300);
  EXPECT_DOUBLE_EQ(turns.granted_rpm(299), 240);
  const CoarseDrive fine({.rpm = 0.1});
  EXPECT_DOUBLE_EQ(fine.granted_rpm(99), 99);
  EXPECT_DOUBLE_EQ(CoarseDrive({}).granted_rpm(99), 99);
}

/// Whoever adds up what was granted ends where the axis stands.
TEST(Planner, WhatIsGrantedIsNoneOfWhatAReadingWavers) {
  const CoarseDrive drive({});
  PositionTracker tracker(Scale({.pulses_per_revolution = 1000, .unit = "rev"}));
  tracker.update(0);
  const auto one = tracker.plan_absolute(1);
  tracker.update(1004, 10);
  tracker.reached(one, 10);
  tracker.update(997, 10);
  for (const auto& target : {tracker.plan_relative(0.5), tracker.plan_absolute(1.5)})
    EXPECT_DOUBLE_EQ(*drive.planner().aimed(drive.profile(100), target, tracker).granted.distance, 0.5);
  tracker.forget_base();
  EXPECT_DOUBLE_EQ(
      *drive.planner().aimed(drive.profile(100), tracker.plan_absolute(1.5), tracker).granted.distance, 0.503)
      << "it stands where it is read";
}

TEST(Planner, CountsOfPulsesAreFinerTheMoreARevolutionHas) {
  const CoarseDrive pulses({.rpm = 60'000, .of_pulse = true});  // 60 r/min with 1000
  EXPECT_DOUBLE_EQ(pulses.granted_rpm(119), 60);
  const CoarseDrive single({.rpm = 60, .of_pulse = true});
  EXPECT_DOUBLE_EQ(single.granted_rpm(119), 118.98);
}

/// At 240 in place of 299 r/min, on the ramp of 299 r/min in 500 ms.
TEST(Planner, PredictsWhatIsSent) {
  const CoarseDrive turns({.rpm = 60});
  const auto seconds = std::chrono::duration<double>(turns.planner().duration(turns.profile(299), 10'000));
  EXPECT_NEAR(seconds.count(), (10'000 / 4000.0) + (0.5 * 240 / 299), 1e-6);
  const auto exact = std::chrono::duration<double>(turns.planner().duration(turns.profile(240), 10'000));
  EXPECT_NEAR(exact.count(), (10'000 / 4000.0) + 0.5, 1e-6);
}

double seconds(Duration time) { return std::chrono::duration<double>(time).count(); }

/// A start is sent as 4, braking as 5 revolutions per second squared, where 4.5 were asked.
TEST(Planner, PredictsRampsInTheCountsThatAreSent) {
  const CoarseDrive turns({.rpm = 60}, {.rpm = 60});
  const auto plan = turns.profile(180, {.acceleration_time = 667ms});
  EXPECT_EQ(plan.acceleration_time, Duration(667ms)) << "the drive's driver rounds it";
  EXPECT_EQ(*plan.granted.acceleration_time, Duration(750ms));
  EXPECT_EQ(*plan.granted.deceleration_time, Duration(600ms));
  EXPECT_NEAR(seconds(turns.planner().duration(plan, 30'000)), (30'000 / 3000.0) + ((0.75 + 0.6) / 2), 1e-6);
  EXPECT_NEAR(seconds(turns.planner().soonest(plan, 30'000)), (30'000 / 3000.0) + ((0.667 + 0.6) / 2), 1e-6);
  const auto exact = turns.profile(180, {.acceleration_time = 600ms});
  EXPECT_EQ(*exact.granted.acceleration_time, Duration(600ms)) << "5 counts";
  EXPECT_EQ(*exact.granted.deceleration_time, Duration(600ms));
}

TEST(Planner, AtLeastOneCountOfARampIsSent) {
  const CoarseDrive turns({.rpm = 60}, {.rpm = 60});
  const auto plan = turns.profile(120, {.acceleration_time = 10s});
  EXPECT_EQ(*plan.granted.acceleration_time, Duration(2s));
  EXPECT_EQ(*plan.granted.deceleration_time, Duration(2s));
  const CoarseDrive pulses({}, {.rpm = 60, .of_pulse = true});  // one per second squared
  EXPECT_EQ(*pulses.profile(60, {.acceleration_time = 150ms}).granted.acceleration_time, Duration(150ms));
}

TEST(Planner, OneRampForBothIsRoundedAsThatOfABrake) {
  const CoarseDrive turns({.rpm = 60}, {.rpm = 60}, 0, false);
  const auto plan = turns.profile(180, {.acceleration_time = 667ms});
  EXPECT_EQ(*plan.granted.acceleration_time, Duration(600ms));
  EXPECT_EQ(*plan.granted.deceleration_time, Duration(600ms));
  EXPECT_EQ(turns.planner().braking_time(3, 667ms), Duration(667ms)) << "never less than told";
}

/// 5000 pulses per second, braked by 1000 of them in a second: 5 s, whatever it is told.
TEST(Planner, AFixedDecelerationIsPartOfThePrediction) {
  const CoarseDrive pulses({.rpm = 60, .of_pulse = true}, {.rpm = 60, .of_pulse = true}, 1000, false);
  const auto plan = pulses.profile(300, {.acceleration_time = 100ms});
  EXPECT_EQ(*plan.granted.acceleration_time, Duration(100ms));
  EXPECT_EQ(*plan.granted.deceleration_time, Duration(5s));
  EXPECT_NEAR(seconds(pulses.planner().braking_time(5, 100ms)), 5, 1e-6);
  EXPECT_NEAR(seconds(pulses.planner().duration(plan, 100'000)), 20 + ((0.1 + 5) / 2), 1e-6);
  EXPECT_NEAR(seconds(pulses.planner().soonest(plan, 100'000)), 20 + 0.1, 1e-6)
      << "one that follows what it is told is not seen too late";
  const auto longer = pulses.planner().stretched(plan, 100'000, 25s);
  EXPECT_NEAR(seconds(longer.predicted), 25, 0.05);
  for (const auto time : {100ms, 200ms}) {
    const auto refused = pulses.planner().profile(5, {.acceleration_time = 100ms, .deceleration_time = time});
    ASSERT_FALSE(refused) << "it would not be kept";
    EXPECT_EQ(refused.error().reason, Reason::not_supported);
  }
  const CoarseDrive alike({.rpm = 60, .of_pulse = true}, {.rpm = 60, .of_pulse = true}, 0, false);
  EXPECT_TRUE(alike.planner().profile(5, {.acceleration_time = 100ms, .deceleration_time = 100ms}));
  const CoarseDrive endless({.rpm = 60, .of_pulse = true}, {.rpm = 0.0006, .of_pulse = true}, 1, false);
  EXPECT_EQ(endless.planner().braking_time(5, 100ms), Duration(24h)) << "and no overflow";
  const CoarseDrive times({}, {}, 3000, false);
  EXPECT_EQ(*times.profile(300).granted.deceleration_time, Duration(3s));
  EXPECT_EQ(*times.profile(300).granted.acceleration_time, Duration(500ms));
}

}  // namespace
}  // namespace axisd
