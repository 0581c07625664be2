#include "tests/unit/devices/cia402_eds/standard_drive_bench.hpp"

namespace axisd::cia402_eds {
namespace {

TEST(StandardDrive, HomesByEachMethod) {
  struct Case {
    int method;
    std::int64_t shaft;  ///< where the edge is
  };
  // The switch is active at and beyond its first position: met forwards it is home there, left one short of
  // it.
  for (const auto& [method, shaft] : {Case{17, -49'999}, Case{18, 49'999}, Case{24, 20'000}, Case{25, 21'000},
                                      Case{28, 21'000}, Case{29, 20'000}}) {
    SCOPED_TRACE(method);
    Bench bench(with_switches());
    bench.home(method);
    EXPECT_FALSE(bench.bit(12));
    bench.run(60s);
    EXPECT_TRUE(bench.bit(12));
    EXPECT_TRUE(bench.bit(10));
    EXPECT_FALSE(bench.bit(13));
    EXPECT_EQ(bench.position(), 0);
    EXPECT_EQ(bench.drive().shaft_pulses(), shaft);
    EXPECT_EQ(bench.drive().starts(), 1);
    bench.control(0x0F);  // again, from on the switch or beside it
    bench.control(0x1F);
    bench.run(60s);
    EXPECT_EQ(bench.drive().shaft_pulses(), shaft);
  }
}

TEST(StandardDrive, RestsBetweenItsPhasesAndCanBeStoppedThere) {
  auto settings = with_switches();
  settings.switches["homing_pauses"] = true;
  Bench bench(settings);
  bench.home(24);
  int rests = 0;
  for (bool rested = true; !bench.bit(12); bench.run(20ms)) {
    const bool rests_now = bench.velocity() == 0;
    rests += rests_now && !rested ? 1 : 0;
    rested = rests_now;
  }
  EXPECT_EQ(rests, 2) << "after the search, and after the switch was left";
  EXPECT_EQ(bench.drive().shaft_pulses(), 20'000);
  Bench stopped(settings);
  stopped.home(24);
  stopped.run(500ms);
  while (stopped.velocity() != 0) stopped.run(10ms);
  stopped.control(0x10F);
  stopped.run(10s);
  EXPECT_FALSE(stopped.bit(12));
  EXPECT_EQ(stopped.velocity(), 0);
}

TEST(StandardDrive, HomesWhereItStandsWithoutMoving) {
  Bench bench;
  bench.enable(1);
  bench.move(777);
  bench.run(1s);
  EXPECT_EQ(bench.write(0x607C, 4, 30), 0U);
  bench.home(35);
  EXPECT_TRUE(bench.bit(12));
  EXPECT_EQ(bench.position(), -30) << "zero is home plus the offset";
  EXPECT_EQ(bench.drive().shaft_pulses(), 777);
  EXPECT_EQ(bench.drive().starts(), 1);
}

TEST(StandardDrive, HomingThatFindsNoSwitchFails) {
  auto settings = with_switches();
  settings.mechanics.home_switch_from.reset();
  Bench bench(settings);
  bench.home(24);
  bench.run(120s);
  EXPECT_TRUE(bench.bit(13));
  EXPECT_FALSE(bench.bit(12));
  EXPECT_EQ(bench.velocity(), 0);
  EXPECT_EQ(bench.write(0x6098, 1, 1), 0x06090030U) << "needs an index pulse";
}

TEST(StandardDrive, HomingEndsWithItsStartBit) {
  for (const bool goes_on : {false, true}) {
    auto settings = with_switches();
    settings.switches["homing_goes_on_without_start_bit"] = goes_on;
    Bench bench(settings);
    bench.home(24);
    bench.run(500ms);
    bench.control(0x0F);
    bench.run(60s);
    EXPECT_EQ(bench.bit(12), goes_on);
    EXPECT_EQ(bench.velocity(), 0);
    EXPECT_EQ(bench.drive().shaft_pulses() == 20'000, goes_on);
  }
}

TEST(StandardDrive, RemembersThatItIsHomedOrForgets) {
  for (const bool forgets : {false, true}) {
    Bench bench({.switches = {{"homing_attained_forgotten", forgets}}});
    bench.home(35);
    EXPECT_EQ(bench.write(0x6060, 1, 1), 0U);
    EXPECT_FALSE(bench.bit(12));
    EXPECT_EQ(bench.write(0x6060, 1, 6), 0U);
    EXPECT_EQ(bench.bit(12), !forgets);
  }
}

}  // namespace
}  // namespace axisd::cia402_eds
