#include "devices/units/scale.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <stdexcept>

#include "devices/units/exact_scale.hpp"

namespace axisd {
namespace {

constexpr auto largest = std::numeric_limits<std::int64_t>::max();
constexpr auto smallest = std::numeric_limits<std::int64_t>::min();

ScaleSettings millimetres() {
  return {.pulses_per_revolution = 10000,
          .travel_numerator = 5,
          .travel_denominator = 1,
          .modulo = {},
          .unit = "mm"};
}

ScaleSettings turntable() {
  return {.pulses_per_revolution = 4000,
          .gear_motor = 10,
          .gear_output = 1,
          .travel_numerator = 360,
          .travel_denominator = 1,
          .modulo = 360,
          .unit = "deg"};
}

TEST(Scale, ConvertsPositionsBothWays) {
  const Scale scale(millimetres());
  EXPECT_EQ(scale.pulses_per_unit(), 2000);
  EXPECT_EQ(scale.to_pulses(120), 240000);
  EXPECT_EQ(scale.to_units(240000), 120);
  EXPECT_EQ(scale.to_pulses(-0.5), -1000);
}

TEST(Scale, GearIsMotorRevolutionsPerOutputRevolution) {
  const Scale scale(turntable());
  EXPECT_EQ(scale.to_pulses(360), 40000);
  EXPECT_EQ(scale.to_units(10000), 90);
}

TEST(Scale, InvertTurnsPositionsAndVelocities) {
  auto settings = millimetres();
  settings.invert = true;
  const Scale scale(settings);
  EXPECT_EQ(scale.pulses_per_unit(), -2000);
  EXPECT_EQ(scale.to_pulses(1), -2000);
  EXPECT_EQ(scale.to_units(-2000), 1);
  EXPECT_EQ(scale.velocity_to_rpm(100), -1200);
  EXPECT_EQ(scale.velocity_to_units(-1200), 100);
}

TEST(Scale, VelocityIsOfTheMotor) {
  EXPECT_DOUBLE_EQ(Scale(millimetres()).velocity_to_rpm(100), 1200);
  EXPECT_DOUBLE_EQ(Scale(turntable()).velocity_to_rpm(36), 60);
  EXPECT_DOUBLE_EQ(Scale(turntable()).velocity_to_units(60), 36);
}

TEST(Scale, RoundsHalfAwayFromZero) {
  const Scale scale({.pulses_per_revolution = 1, .modulo = {}});
  EXPECT_EQ(scale.to_pulses(0.5), 1);
  EXPECT_EQ(scale.to_pulses(-0.5), -1);
  EXPECT_EQ(scale.to_pulses(2.5), 3);
  EXPECT_EQ(scale.to_pulses(std::nextafter(0.5, 0)), 0);
  EXPECT_EQ(scale.to_pulses(-std::nextafter(0.5, 0)), 0);
  EXPECT_EQ(scale.to_pulses(9007199254740991.0), 9007199254740991);
}

TEST(Scale, SaturatesInsteadOfOverflowing) {
  const double infinity = std::numeric_limits<double>::infinity();
  const Scale scale(millimetres());
  auto settings = millimetres();
  settings.invert = true;
  const Scale inverted(settings);
  for (const double huge : {1e300, infinity, 9.3e18, std::numeric_limits<double>::max()}) {
    EXPECT_EQ(scale.to_pulses(huge), largest);
    EXPECT_EQ(scale.to_pulses(-huge), smallest);
    EXPECT_EQ(inverted.to_pulses(huge), smallest);
    EXPECT_EQ(inverted.to_pulses(-huge), largest);
    EXPECT_EQ(scale.checked_pulses(huge), std::nullopt);
    EXPECT_EQ(scale.checked_pulses(-huge), std::nullopt);
  }
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(scale.to_pulses(nan), 0);
  EXPECT_EQ(scale.checked_pulses(nan), std::nullopt);
  EXPECT_EQ(scale.to_pulses(std::numeric_limits<double>::denorm_min()), 0);
  EXPECT_TRUE(std::isfinite(scale.to_units(largest)));
  EXPECT_TRUE(std::isfinite(scale.to_units(smallest)));
}

TEST(Scale, RefusesRatiosThatAreNone) {
  EXPECT_FALSE(Scale::valid({.modulo = {}}));
  EXPECT_THROW(Scale({.modulo = {}}), std::invalid_argument);
  auto settings = millimetres();
  settings.travel_numerator = 0;
  EXPECT_FALSE(Scale::valid(settings));
  settings = millimetres();
  settings.gear_output = -1;
  EXPECT_FALSE(Scale::valid(settings));
  settings = millimetres();
  settings.gear_motor = settings.travel_denominator = largest;
  EXPECT_FALSE(Scale::valid(settings));
  settings = millimetres();
  settings.gear_motor = settings.gear_output = largest;  // cancels
  EXPECT_TRUE(Scale::valid(settings));
  EXPECT_EQ(Scale(settings).to_pulses(1), 2000);
}

TEST(Scale, PulsesSurviveTheWayToUnitsAndBack) {
  std::mt19937_64 random(19);
  std::uniform_int_distribution<std::int64_t> ratio(1, 1'000'000), pulses(-(1LL << 48), 1LL << 48);
  for (int i = 0; i < 5000; ++i) {
    const Scale scale({.pulses_per_revolution = 200 + ratio(random) % 51000,
                       .gear_motor = ratio(random),
                       .gear_output = ratio(random),
                       .travel_numerator = ratio(random),
                       .travel_denominator = ratio(random),
                       .invert = i % 2 == 0,
                       .modulo = {}});
    const auto count = pulses(random);
    ASSERT_EQ(scale.to_pulses(scale.to_units(count)), count);
    ASSERT_EQ(to_pulses(scale, to_exact_units(scale, count)), count);
  }
}

TEST(Scale, ConversionIsMonotonic) {
  std::mt19937_64 random(20);
  std::uniform_real_distribution<double> units(-1e6, 1e6);
  const Scale scale({.pulses_per_revolution = 51200,
                     .gear_motor = 7,
                     .gear_output = 3,
                     .travel_numerator = 22,
                     .travel_denominator = 7,
                     .modulo = {}});
  for (int i = 0; i < 5000; ++i) {
    const double a = units(random), b = units(random);
    ASSERT_EQ(a < b, scale.to_pulses(a) < scale.to_pulses(b)) << a << " " << b;
    ASSERT_LE(std::abs(static_cast<double>(scale.to_pulses(a)) - a * scale.pulses_per_unit()), 0.5001);
  }
}

// M19: a table that is indexed by a third of a turn, 100,000 times, stands where it should: rounded once, not
// summed.
TEST(ExactScale, IndexingByAThirdDoesNotDrift) {
  const Scale scale({.pulses_per_revolution = 200, .modulo = {}});  // 66 2/3 pulses per step
  Exact target = 0, from_double = 0;
  const Exact third(1, 3), nearly_third = *to_exact(1.0 / 3);
  for (std::int64_t i = 1; i <= 100'000; ++i) {
    target += third;
    from_double += nearly_third;
    const std::int64_t expected = (2 * 200 * i + 3) / 6;  // i * 200 / 3, rounded
    ASSERT_EQ(to_pulses(scale, target), expected) << i;
    ASSERT_EQ(to_pulses(scale, from_double), expected) << i;
  }
}

TEST(ExactScale, RefusesWhatDoesNotFit) {
  const Scale scale(millimetres());
  EXPECT_EQ(to_exact(std::numeric_limits<double>::quiet_NaN()), std::nullopt);
  EXPECT_EQ(to_exact(-std::numeric_limits<double>::infinity()), std::nullopt);
  EXPECT_EQ(to_pulses(scale, *to_exact(1e300)), std::nullopt);
  EXPECT_EQ(to_pulses(scale, *to_exact(-1e300)), std::nullopt);
  EXPECT_EQ(to_pulses(scale, Exact(1, 4000)), 1);
  EXPECT_EQ(to_pulses(scale, Exact(-1, 4000)), -1);
}

}  // namespace
}  // namespace axisd
