#include "devices/simulation/motor.hpp"

#include <gtest/gtest.h>

namespace axisd::simulation {
namespace {

using namespace std::chrono_literals;

/// 60 r/min at 1000 pulses per revolution, ramps of 100 ms.
Rates told() { return rates_from(5, 60, 100, 100, 1000); }

TEST(Motor, RunsAsFastAsItIsToldOrSomeTimesAsFast) {
  for (const double factor : {1.0, 2.0, 90.0, 0.1}) {
    Motor motor;
    motor.run_at(factor);
    motor.move(100'000, told());
    motor.advance(TimePoint(150ms));
    EXPECT_NEAR(motor.speed(), 1000 * factor, 1e-6) << "its ramps take as long as told";
    motor.advance(motor.ends());
    EXPECT_FALSE(motor.moving());
    EXPECT_EQ(motor.commanded(), 100'000) << "and go as far";
  }
}

TEST(Motor, BrakesSomeTimesAsHardToo) {
  for (const bool told_again : {false, true}) {
    Motor motor;
    motor.run_at(90);
    motor.run(1, told());
    motor.advance(TimePoint(200ms));
    const auto at = motor.commanded();
    const auto distance = motor.stopping_distance(told());
    told_again ? motor.brake(told().deceleration) : motor.brake();
    EXPECT_LE(motor.ends(), TimePoint(301ms));
    motor.advance(motor.ends());
    EXPECT_NEAR(static_cast<double>(motor.commanded() - at), distance, 1);
  }
}

}  // namespace
}  // namespace axisd::simulation
