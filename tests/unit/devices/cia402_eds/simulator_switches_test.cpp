// What makers do in different ways: each switch of the simulated standard drive in both positions.
#include <algorithm>
#include <cstdlib>

#include "tests/unit/devices/cia402_eds/standard_drive_bench.hpp"

namespace axisd::cia402_eds {
namespace {

constexpr unsigned attained_bit = 1U << 12U, reached_bit = 1U << 10U;

Bench with(const char* name, bool on) { return Bench({.switches = {{name, on}}}); }

/// Bits 10 and 12 within 20 ms after homing, and later.
std::pair<unsigned, unsigned> after_homing(Bench bench) {
  bench.home(35);
  const auto early = bench.status() & (attained_bit | reached_bit);
  bench.run(25ms);
  return {early, bench.status() & (attained_bit | reached_bit)};
}

TEST(StandardDriveSwitches, HomingIsToldInEitherOrder) {
  constexpr unsigned both = attained_bit | reached_bit;
  for (const bool on : {false, true}) {
    const auto [early, later] = after_homing(with("homing_attained_early", on));
    EXPECT_EQ(early, on ? attained_bit : both);
    EXPECT_EQ(later, both);
    const auto [before, after] = after_homing(with("homing_attained_late", on));
    EXPECT_EQ(before, on ? reached_bit : both);
    EXPECT_EQ(after, both);
  }
}

TEST(StandardDriveSwitches, HomedIsShownUntilTheNextStart) {
  auto settings = with_switches();
  Bench bench(settings);
  bench.home(35);
  EXPECT_TRUE(bench.bit(12));
  bench.control(0x0F);
  EXPECT_EQ(bench.write(0x6098, 1, 24), 0U);
  EXPECT_TRUE(bench.bit(12)) << "of the homing before";
  bench.control(0x1F);
  EXPECT_FALSE(bench.bit(12));
}

TEST(StandardDriveSwitches, NoModeIsAModeOrLeavesTheOneBefore) {
  for (const bool nothing : {false, true}) {
    auto bench = with("no_mode_changes_nothing", nothing);
    bench.enable(1);
    EXPECT_EQ(bench.write(0x6060, 1, 0), 0U);
    EXPECT_EQ(bench.read(0x6061) & 0xFF, nothing ? 1 : 0);
    bench.move(5'000);
    bench.run(1s);
    EXPECT_EQ(bench.position(), nothing ? 5'000 : 0);
  }
}

TEST(StandardDriveSwitches, AChangeOfTheModeIsATargetReachedOrNot) {
  for (const bool on : {false, true}) {
    auto bench = with("mode_change_is_target_reached", on);
    bench.enable(3);
    bench.write(0x60FF, 4, 10'000);
    bench.run(20ms);
    EXPECT_EQ(bench.write(0x6060, 1, 0), 0U);
    bench.run(1ms);
    EXPECT_TRUE(bench.drive().shaft_moving());
    EXPECT_EQ(bench.bit(10), on) << "though it moves";
    bench.control(0x10F);
    EXPECT_FALSE(bench.bit(10)) << "it brakes under a halt";
    bench.run(2s);
    EXPECT_TRUE(bench.bit(10));
    EXPECT_EQ(bench.write(0x6060, 1, 1), 0U);
    bench.control(0x0F);
    bench.move(5'000);
    EXPECT_FALSE(bench.bit(10)) << "a new target";
  }
}

TEST(StandardDriveSwitches, ASetPointIsAcknowledgedAtOnceOrLate) {
  for (const bool late : {false, true}) {
    auto bench = with("acknowledges_late", late);
    bench.enable(1);
    bench.move(10'000);
    EXPECT_EQ(bench.bit(12), !late);
    EXPECT_EQ(bench.drive().starts(), 1) << "it runs already";
    bench.run(10ms);
    EXPECT_TRUE(bench.bit(12));
    bench.control(0x0F);
    EXPECT_FALSE(bench.bit(12));
  }
}

TEST(StandardDriveSwitches, TheAcknowledgementFallsWithItsBitOrAtTheTarget) {
  for (const bool alone : {false, true}) {
    auto bench = with("acknowledgement_ends_with_motion", alone);
    bench.enable(1);
    bench.move(5'000);
    bench.run(300ms);
    EXPECT_TRUE(bench.bit(12));
    bench.run(1s);
    EXPECT_EQ(bench.bit(12), !alone);
    bench.control(0x0F);
    EXPECT_FALSE(bench.bit(12));
    bench.move(6'000);
    bench.run(1s);
    EXPECT_EQ(bench.position(), 6'000);
  }
}

TEST(StandardDriveSwitches, ASetPointWaitsOrReplacesTheOneBefore) {
  for (const bool at_once : {false, true}) {
    auto bench = with("set_points_change_at_once", at_once);
    bench.enable(1);
    bench.move(30'000);
    bench.run(500ms);
    bench.move(10'000);
    bench.run(2s);
    EXPECT_EQ(bench.position() == 10'000, at_once);
    bench.control(0x0F);
    bench.run(5s);
    EXPECT_EQ(bench.position(), 10'000);
  }
}

TEST(StandardDriveSwitches, TheErrorCodeIsOfTheLastErrorOrOfTheOneThere) {
  for (const bool kept : {false, true}) {
    auto bench = with("error_code_kept", kept);
    bench.drive().raise_alarm(0x2310);
    EXPECT_EQ(bench.read(0x603F), 0x2310);
    bench.control(0x80);
    EXPECT_EQ(bench.status() & 0x4FU, 0x40U);
    EXPECT_EQ(bench.read(0x603F), kept ? 0x2310 : 0);
    EXPECT_EQ(bench.read(0x1001), 0);
  }
}

TEST(StandardDriveSwitches, VelocityWaversOrIsExactAtRest) {
  for (const bool wavers : {false, true}) {
    auto bench = with("velocity_wavers_at_rest", wavers);
    int off = 0;
    for (int i = 0; i < 100; ++i) {
      bench.run(5ms);
      EXPECT_EQ(bench.position(), 0);
      EXPECT_LE(std::abs(bench.velocity()), 17) << "1 r/min of 1000 increments";
      off += bench.velocity() != 0 ? 1 : 0;
    }
    EXPECT_EQ(off > 20, wavers);
  }
}

TEST(StandardDriveSwitches, VelocityWaversByItsThreshold) {
  for (const bool wavers : {false, true}) {
    auto bench = Bench({.encoder = {.noise = 1}, .switches = {{"velocity_wavers_by_threshold", wavers}}});
    int off = 0;
    for (int i = 0; i < 100; ++i) {
      bench.run(5ms);
      EXPECT_LE(std::abs(bench.velocity()), wavers ? 100 : 17);
      off += std::abs(bench.velocity()) == 100 ? 1 : 0;
    }
    EXPECT_EQ(off > 20, wavers);
  }
}

TEST(StandardDriveSwitches, PositionSettlesOrIsThereAtOnce) {
  for (const bool settles : {false, true}) {
    auto bench = with("settles_over_30_counts", settles);
    bench.enable(1);
    bench.move(10'000);
    while (bench.drive().shaft_moving()) bench.run(1ms);
    EXPECT_NEAR(10'000 - bench.position(), settles ? 30 : 0, settles ? 4 : 0);
    EXPECT_FALSE(bench.bit(10)) << "6068h";
    bench.run(200ms);
    EXPECT_EQ(bench.position(), 10'000);
    EXPECT_TRUE(bench.bit(10));
  }
}

}  // namespace
}  // namespace axisd::cia402_eds
