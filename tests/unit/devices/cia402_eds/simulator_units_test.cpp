// What the simulated drive's objects are in turns of its shaft, as literals.
#include "devices/cia402_eds/simulator_units.hpp"

#include <gtest/gtest.h>

#include <initializer_list>
#include <numbers>

#include "tests/unit/devices/cia402_eds/standard_drive_bench.hpp"

namespace axisd::cia402_eds {
namespace {

using simulation::RateUnit;
using simulation::UnitSettings;

struct Told {
  std::uint16_t index;
  std::int64_t value;
  std::uint8_t sub = 0;
};

ShaftUnits units_with(std::initializer_list<Told> objects,
                      const UnitSettings& settings = {.counts_per_revolution = 4000}) {
  simulation::CanopenDictionary dictionary;
  for (const auto& [index, value, sub] : objects)
    dictionary.add({.index = index,
                    .sub = sub,
                    .size = 4,
                    .is_signed = index == 0x6089 || index == 0x608B || index == 0x608D,
                    .default_value = value});
  return units_of(dictionary, settings);
}

TEST(ShaftUnits, AreIncrementsOfTheEncoderWhereNothingIsTold) {
  const auto units = units_with({});
  EXPECT_DOUBLE_EQ(units.position, 1.0 / 4000);
  EXPECT_DOUBLE_EQ(units.velocity, 1.0 / 4000);
  EXPECT_DOUBLE_EQ(units.acceleration, 1.0 / 4000);
  EXPECT_DOUBLE_EQ(units_with({{0x608F, 2048, 1}, {0x608F, 1, 2}}).position, 1.0 / 2048);
  EXPECT_DOUBLE_EQ(units_with({{0x608F, 36000, 1}, {0x608F, 5, 2}}).position, 1.0 / 7200);
  EXPECT_DOUBLE_EQ(units_with({{0x608F, 1, 1}, {0x608F, 1, 2}}).position, 1.0 / 4000) << "a template";
  EXPECT_DOUBLE_EQ(units_with({{0x60A8, 0}, {0x60A9, 0}, {0x60AA, 0}}).velocity, 1.0 / 4000);
}

TEST(ShaftUnits, AreThoseOfTheFeedWhereThereIsOne) {
  const auto fed = units_with({{0x608F, 2048, 1}, {0x608F, 1, 2}, {0x6092, 36'000, 1}, {0x6092, 1, 2}});
  EXPECT_DOUBLE_EQ(fed.position, 1.0 / 36'000);
  EXPECT_DOUBLE_EQ(fed.velocity, 1.0 / 36'000) << "positions per second";
  EXPECT_DOUBLE_EQ(units_with({{0x6092, 36'000, 1}, {0x6092, 5, 2}}).position, 1.0 / 7200);
  EXPECT_DOUBLE_EQ(units_with({{0x6092, 1, 1}, {0x6092, 1, 2}}).position, 1.0 / 4000) << "a template";
  EXPECT_DOUBLE_EQ(units_with({{0x60A8, 0xFF410000}, {0x6092, 36'000, 1}, {0x6092, 1, 2}}).position,
                   1.0 / 3600);
}

TEST(ShaftUnits, FollowTheSiUnits) {
  EXPECT_DOUBLE_EQ(units_with({{0x60A8, 0x00B50000}}).position, 1.0 / 4000);
  EXPECT_DOUBLE_EQ(units_with({{0x60A8, 0xFF410000}}).position, 1.0 / 3600) << "0.1 degrees";
  EXPECT_DOUBLE_EQ(units_with({{0x60A8, 0xFDB40000}}).position, 0.001) << "revolutions";
  EXPECT_DOUBLE_EQ(units_with({{0x60A8, 0xFD100000}}).position, 0.001 / (2 * std::numbers::pi));
  EXPECT_DOUBLE_EQ(units_with({{0x60A9, 0x00B44700}}).velocity, 1.0 / 60);
  EXPECT_DOUBLE_EQ(units_with({{0x60A9, 0xFFB44700}}).velocity, 0.1 / 60);
  EXPECT_DOUBLE_EQ(units_with({{0x60A9, 0xFDB40300}}).velocity, 0.001);
  EXPECT_DOUBLE_EQ(units_with({{0x60A9, 0x00410300}}).velocity, 1.0 / 360);
  EXPECT_DOUBLE_EQ(units_with({{0x60A9, 0x00B50300}}).velocity, 1.0 / 4000);
  EXPECT_DOUBLE_EQ(units_with({{0x60AA, 0x00C00300}}).acceleration, 1.0 / 60);
  EXPECT_DOUBLE_EQ(units_with({{0x60AA, 0x00B45700}}).acceleration, 1);
  EXPECT_DOUBLE_EQ(units_with({{0x60A9, 0x00B44700}}).acceleration, 1.0 / 60) << "velocity units per second";
  EXPECT_DOUBLE_EQ(units_with({{0x60A9, 0x00010300}}).velocity, 1.0 / 4000) << "metres are not understood";
}

TEST(ShaftUnits, FollowTheOlderIndices) {
  EXPECT_DOUBLE_EQ(units_with({{0x608C, 0xA4}, {0x608B, 0}}).velocity, 1.0 / 60);
  EXPECT_DOUBLE_EQ(units_with({{0x608C, 0xA4}, {0x608B, -1}}).velocity, 0.1 / 60);
  EXPECT_DOUBLE_EQ(units_with({{0x608C, 0xA4}, {0x608B, 0xFF}}).velocity, 0.1 / 60) << "as unsigned";
  EXPECT_DOUBLE_EQ(units_with({{0x608C, static_cast<std::int8_t>(0xA4)}}).velocity, 1.0 / 60) << "as signed";
  EXPECT_DOUBLE_EQ(units_with({{0x608C, 0}}).velocity, 1.0 / 4000);
  EXPECT_DOUBLE_EQ(units_with({{0x608E, 0xA4}}).acceleration, 1.0 / 60);
  EXPECT_DOUBLE_EQ(units_with({{0x608E, 0xAF}}).acceleration, 1);
  EXPECT_DOUBLE_EQ(units_with({{0x608A, 0x41}, {0x6089, -2}}).position, 1.0 / 36000);
  EXPECT_DOUBLE_EQ(units_with({{0x60A9, 0x00B40300}, {0x608C, 0xA4}}).velocity, 1) << "SI units first";
}

TEST(ShaftUnits, APositionFactorLeavesTheRevolutionThatIsMeant) {
  const std::initializer_list<Told> factor{
      {0x608F, 3000, 1}, {0x608F, 18, 2}, {0x6093, 3000, 1}, {0x6093, 18'000, 2}};
  EXPECT_DOUBLE_EQ(units_with(factor).position, 1.0 / 4000);
  EXPECT_DOUBLE_EQ(units_with({{0x608F, 2048, 1}, {0x608F, 1, 2}, {0x6093, 1, 1}, {0x6093, 1, 2}}).position,
                   1.0 / 2048)
      << "a factor of 1";
}

TEST(ShaftUnits, AreAsSetWhereNothingIsTold) {
  const auto with = [](RateUnit velocity, std::optional<RateUnit> acceleration) {
    return units_with({},
                      {.counts_per_revolution = 4000, .velocity = velocity, .acceleration = acceleration});
  };
  EXPECT_DOUBLE_EQ(with({1.0 / 60}, {}).velocity, 1.0 / 60);
  EXPECT_DOUBLE_EQ(with({1.0 / 60}, {}).acceleration, 1.0 / 60) << "per second";
  EXPECT_DOUBLE_EQ(with({}, {}).velocity, 1.0 / 4000);
  EXPECT_DOUBLE_EQ(with({}, RateUnit{1.0 / 60}).acceleration, 1.0 / 60);
  EXPECT_DOUBLE_EQ(with({1}, RateUnit{}).acceleration, 1.0 / 4000);
}

/// The drive itself: 120 r/min of a shaft with 1000 increments are 2 revolutions in a second.
TEST(ShaftUnits, MakeTheTrueSpeed) {
  Bench bench({.units = {.velocity = {1.0 / 60}}});
  EXPECT_EQ(bench.write(0x6083, 4, 6'000), 0U);
  EXPECT_EQ(bench.write(0x60FF, 4, 120), 0U);
  bench.enable(3);
  bench.run(1s);
  const auto before = bench.drive().shaft_pulses();
  bench.run(1s);
  EXPECT_NEAR(bench.drive().shaft_pulses() - before, 2'000, 1);
  EXPECT_EQ(bench.velocity(), 120);
}

}  // namespace
}  // namespace axisd::cia402_eds
