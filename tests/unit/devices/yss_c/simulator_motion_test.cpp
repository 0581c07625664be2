// States, motions, stops, terminals and alarms of the simulated drive.
#include <gmock/gmock.h>

#include <cmath>

#include "tests/unit/devices/yss_c/simulator_fixture.hpp"

namespace axisd::yss_c {
namespace {

TEST(YssCState, FollowsTheTableOf621) {
  struct Step {
    std::uint16_t word;
    int bits;
    bool energised;
  };
  Bench bench;
  for (const auto& [word, bits, energised] : {Step{0x07, 0x60, false},
                                              {0x0F, 0x60, false},
                                              {0x06, 0x21, false},
                                              {0x07, 0x23, true},
                                              {0x06, 0x21, false},
                                              {0x0F, 0x27, true},
                                              {0x07, 0x23, true},
                                              {0x0F, 0x27, true},
                                              {0x06, 0x21, false},
                                              {0x0F, 0x27, true},
                                              {0x0B, 0x07, true},
                                              {0x0F, 0x27, true},
                                              {0x0B, 0x07, true},
                                              {0x00, 0x40, false},
                                              {0x06, 0x21, false},
                                              {0x02, 0x40, false},
                                              {0x06, 0x21, false},
                                              {0x07, 0x23, true},
                                              {0x00, 0x40, false}}) {
    bench.control(word);
    EXPECT_EQ(bits, bench.status() & 0x6F) << word;
    EXPECT_EQ(energised, bench.bit(13)) << word;
  }
  EXPECT_EQ(0, bench.drive().starts());
}

TEST(YssCMotion, PositionIsATrapezoid) {
  // 1000 pulses/rev, 120 r/min: 2000 pulses/s, 5 r/min: 83.3; both ramps 100 ms and 104.2 pulses.
  Bench bench;
  bench.enable(1);
  bench.move(2000);
  bench.run(1ms);
  bench.run(100ms);
  EXPECT_EQ(120, bench.read(0x2002));
  const auto before = bench.position();
  bench.run(500ms - 1ms);
  EXPECT_EQ(before + 1000, bench.position());
  EXPECT_EQ(1, bench.read(0x2001));
  bench.run(493ms);
  EXPECT_TRUE(bench.bit(10) && bench.bit(15));
  EXPECT_EQ(2000, bench.position());
  bench.control(0x0F);
  bench.move(-2500, false);
  EXPECT_EQ(-120, (bench.run(500ms), static_cast<std::int16_t>(bench.read(0x2002))));
  bench.run(5s);
  EXPECT_EQ(-2500, bench.position());
}

TEST(YssCMotion, AcknowledgesSetPointsAndBuffersOne) {
  Bench bench;
  bench.enable(1);
  bench.move(1000);
  EXPECT_TRUE(bench.bit(12) && bench.bit(11));
  bench.control(0x4F);
  EXPECT_FALSE(bench.bit(12) || bench.bit(11));
  bench.control(0x5F);
  EXPECT_TRUE(bench.bit(12)) << "buffered";
  bench.control(0x4F);
  EXPECT_TRUE(bench.bit(12)) << "the buffer is full";
  bench.control(0x5F);
  bench.control(0x4F);
  bench.run(5s);
  EXPECT_FALSE(bench.bit(12));
  EXPECT_EQ(2000, bench.position()) << "the third was not taken";
  EXPECT_EQ(2, bench.drive().starts());
}

TEST(YssCMotion, Bit5TakesOverAtOnceFromTheTargetBefore) {
  Bench bench;
  bench.enable(1);
  bench.move(5000);
  bench.run(500ms);
  bench.control(0x6F);
  EXPECT_EQ(0U, bench.write(0x607A, 4, -5500));
  bench.control(0x7F);
  bench.run(10s);
  EXPECT_EQ(-500, bench.position());
}

TEST(YssCMotion, HaltBrakesOrCutsAndResumesTheMove) {
  for (const int option : {0, 1}) {
    Bench bench;
    EXPECT_EQ(0U, bench.write(0x605D, 2, option));
    bench.enable(1);
    bench.move(5000);
    bench.run(1s);
    bench.control(0x11F);
    EXPECT_EQ(option == 0, bench.drive().shaft_moving());
    bench.run(200ms);
    EXPECT_TRUE(bench.bit(10) && !bench.bit(14));
    EXPECT_LT(bench.position(), 3000);
    EXPECT_EQ(0x27, bench.status() & 0x6F);
    bench.control(0x0F);
    bench.run(5s);
    EXPECT_EQ(5000, bench.position());
  }
}

TEST(YssCMotion, ASetPointGivenInHaltStartsWithItsRelease) {
  Bench bench;
  bench.enable(1);
  bench.control(0x14F);
  bench.control(0x15F);
  EXPECT_EQ(0, bench.drive().starts());
  EXPECT_TRUE(bench.bit(12));
  bench.control(0x4F);
  EXPECT_EQ(1, bench.drive().starts());
}

TEST(YssCMotion, DisablingDropsWhatWaits) {
  Bench bench;
  bench.enable(1);
  bench.move(5000);
  bench.run(1s);
  bench.control(0x10F);
  bench.run(1s);
  bench.control(0x106);
  bench.control(0x10F);
  bench.control(0x0F);
  EXPECT_EQ(1, bench.drive().starts());
}

TEST(YssCMotion, EnablingInVelocityModeIsTheStart) {
  Bench bench;
  bench.write(0x60FF, 4, -300);
  bench.enable(3);
  EXPECT_EQ(1, bench.drive().starts());
  bench.run(1s);
  EXPECT_EQ(-300, static_cast<std::int16_t>(bench.read(0x2002)));
  bench.write(0x60FF, 4, 300);
  bench.run(1s);
  EXPECT_EQ(300, bench.read(0x2002));
  EXPECT_EQ(2, bench.drive().starts());
  bench.write(0x60FF, 4, 0);
  bench.run(1s);
  EXPECT_TRUE(bench.bit(10) && bench.bit(12) && !bench.bit(14));
  EXPECT_EQ(0x27, bench.status() & 0x6F);
}

TEST(YssCMotion, VelocityChangesWithinTheTimes) {
  Bench bench;
  bench.enable(3);
  bench.write(0x60FF, 4, 600);
  bench.run(200ms);
  bench.write(0x6084, 4, 1000);
  bench.write(0x60FF, 4, 100);
  bench.run(500ms - 1ms);
  EXPECT_NEAR(350, static_cast<double>(bench.read(0x2002)), 2);
  EXPECT_FALSE(bench.bit(10));
  bench.run(600ms);
  EXPECT_EQ(100, bench.read(0x2002));
  EXPECT_TRUE(bench.bit(10));
}

TEST(YssCMotion, SpeedIsLimitedBy200Kilohertz) {
  Bench bench;
  bench.write(0x2006, 2, 7);
  bench.enable(3);
  bench.write(0x60FF, 4, 3000);
  bench.run(1s);
  EXPECT_EQ(234, bench.read(0x2002));
}

TEST(YssCLimits, StopTheMotionAndItsDirectionOnly) {
  Bench bench({}, {.mechanics = {.positive_limit_from = 1000}});
  bench.assign(3, 2);
  bench.enable(3);
  bench.write(0x60FF, 4, 60);
  bench.run(3s);
  EXPECT_EQ(1000, bench.drive().shaft_pulses());
  EXPECT_EQ(8, bench.read(0x2003));
  bench.control(0x0F);
  bench.write(0x60FF, 4, 30);
  bench.run(100ms);
  EXPECT_EQ(1, bench.drive().starts());
  bench.write(0x60FF, 4, -60);
  bench.run(500ms);
  EXPECT_LT(bench.drive().shaft_pulses(), 1000);
}

TEST(YssCHoming, TheFourMethodsOf626) {
  struct Case {
    int method;
    std::int64_t ends;
  };
  const simulation::Mechanics mechanics{.home_switch_from = 300,
                                        .home_switch_to = 500,
                                        .positive_limit_from = 4000,
                                        .negative_limit_from = -4000};
  for (const auto& [method, ends] : {Case{17, -4000}, {18, 4000}, {24, 300}, {29, 300}}) {
    Bench bench({}, {.mechanics = mechanics});
    for (const int function : {1, 2, 3}) bench.assign(function, function);
    EXPECT_EQ(0U, bench.write(0x6098, 1, method));
    bench.enable(6);
    bench.control(0x1F);
    EXPECT_FALSE(bench.bit(8) || bench.bit(10));
    bench.run(30s);
    EXPECT_TRUE(bench.bit(8) && bench.bit(10) && bench.bit(12)) << method;
    EXPECT_EQ(ends, bench.drive().shaft_pulses()) << method;
    EXPECT_EQ(0, bench.position()) << method;
  }
}

TEST(YssCHoming, MayTakeTheCodesOfChapter7) {
  Bench bench({{"homing_codes_0_to_3", true}, {"homing_codes_cia", false}},
              {.mechanics = {.home_switch_from = 300, .home_switch_to = 500}});
  EXPECT_EQ(0x06090030U, bench.write(0x6098, 1, 24));
  bench.assign(0, 1);
  bench.enable(6);
  bench.control(0x1F);
  bench.run(20s);
  EXPECT_EQ(300, bench.drive().shaft_pulses()) << "0: home up";
}

TEST(YssCHoming, IsNotDoneWhenHalted) {
  Bench bench({}, {.mechanics = {.home_switch_from = 3000, .home_switch_to = 5000}});
  bench.assign(0, 1);
  bench.write(0x6098, 1, 24);
  bench.enable(6);
  bench.control(0x1F);
  bench.run(100ms);
  bench.control(0x11F);
  bench.run(1s);
  EXPECT_TRUE(!bench.bit(8) && bench.bit(10) && !bench.bit(12) && !bench.bit(14));
}

TEST(YssCTerminals, StartStopReleaseAndReport) {
  Bench bench;
  for (const auto& [input, function] : {std::pair{0, 12}, {1, 8}, {2, 5}, {3, 4}})
    bench.assign(input, function);
  bench.write(0x2030, 0x0D, 2, 2);
  auto& drive = bench.drive();
  drive.set_input("X3", true);
  bench.run(20ms);
  EXPECT_TRUE(bench.bit(13)) << "enable terminal";
  drive.set_input("X0", true);
  EXPECT_EQ(0, drive.starts()) << "filtered for 10 ms";
  bench.run(11ms);
  EXPECT_EQ(1, drive.starts());
  EXPECT_EQ(1, bench.read(0x2004));
  drive.set_input("X1", true);
  bench.run(200ms);
  EXPECT_FALSE(drive.shaft_moving());
  drive.set_input("X2", true);
  bench.run(20ms);
  EXPECT_TRUE(drive.push_shaft(5)) << "released by its terminal";
  EXPECT_FALSE(drive.has_input("X7"));
}

TEST(YssCAlarms, FollowTheResetRulesOfChapter8) {
  for (const int code : {1, 2, 3, 4, 5}) {
    SCOPED_TRACE(code);
    Bench bench;
    bench.enable(3);
    bench.write(0x60FF, 4, 60);
    bench.drive().raise_alarm(code);
    EXPECT_EQ(0xFF00 + code, bench.read(0x603F));
    EXPECT_EQ(0x08, bench.status() & 0x4F);
    EXPECT_FALSE(bench.drive().shaft_moving());
    bench.write(0x2011, 2, 1);
    EXPECT_EQ(code == 4 ? 0 : 0xFF00 + code, bench.read(0x603F)) << "2011h";
    bench.drive().raise_alarm(0);
    bench.control(0x8F);
    const bool stays = code == 1 || code == 5;
    EXPECT_EQ(stays ? 0xFF00 + code : 0, bench.read(0x603F));
    EXPECT_EQ(stays ? 0x08 : 0x60, bench.status() & 0x6F);
    bench.put("000 81 01");
    bench.run(1s);
    EXPECT_EQ(stays ? 0xFF00 + code : 0, bench.read(0x603F)) << "NMT reset is no power cycle";
    bench.drive().set_power(false);
    bench.drive().set_power(true);
    bench.run(1s);
    EXPECT_EQ(0, bench.read(0x603F));
    EXPECT_EQ(1, bench.drive().starts());
  }
}

TEST(YssCAlarms, ABlockedShaftIsADeviation) {
  Bench bench;
  bench.enable(1);
  bench.drive().block_shaft(true);
  bench.move(5000);
  bench.run(5s);
  EXPECT_EQ(0xFF05, bench.read(0x603F));
  EXPECT_EQ(0, bench.drive().shaft_pulses());
}

TEST(YssCPower, OffIsSilentAndClearsRamAndPosition) {
  Bench bench;
  bench.enable(1);
  bench.move(700);
  bench.run(3s);
  bench.write(0x200E, 2, 50);
  bench.write(0x2044, 2, 60);
  bench.drive().set_power(false);
  EXPECT_EQ("silence", bench.ask("601 40 00 10 00 00 00 00 00"));
  bench.drive().set_power(true);
  EXPECT_EQ("silence", bench.ask("601 40 00 10 00 00 00 00 00"));
  EXPECT_THAT(bench.run(300ms), ::testing::ElementsAre("701 00"));
  EXPECT_EQ(0, bench.position());
  EXPECT_EQ(700, bench.drive().shaft_pulses());
  EXPECT_EQ(5, bench.read(0x200E));
  EXPECT_EQ(60, bench.read(0x2044)) << "RW/S";
  EXPECT_EQ(0x40, bench.status() & 0x6F);
}

TEST(YssCPower, SavesCountsAndRestores) {
  Bench bench;
  bench.write(0x2044, 2, 60);
  EXPECT_EQ(1U, bench.drive().eeprom_writes());
  bench.write(0x200C, 2, 1);
  bench.write(0x2044, 2, 70);
  EXPECT_EQ(1U, bench.drive().eeprom_writes());
  bench.write(0x200E, 2, 50);
  bench.write(0x2010, 2, 2);
  EXPECT_GT(bench.drive().eeprom_writes(), 50U);
  bench.drive().set_power(false);
  bench.drive().set_power(true);
  bench.run(1s);
  EXPECT_EQ(50, bench.read(0x200E));
  EXPECT_EQ(70, bench.read(0x2044));
  bench.write(0x2010, 2, 1);
  EXPECT_EQ(40, bench.read(0x2044));
  EXPECT_EQ(0x60400010, bench.read(0x1600, 1));
}

TEST(YssCPower, NodeAndBitRateCountFromTheNextPowerUp) {
  simulation::SimulatedNodeSettings settings;
  settings.address = 20;
  SimulatedDrive drive(settings);
  drive.join(250'000);
  EXPECT_EQ(20, drive.address());
  EXPECT_EQ(250'000U, drive.bitrate());
  drive.poke(0x200900, 2);
  EXPECT_EQ(250'000U, drive.bitrate());
  settings.address = 5;
  SimulatedDrive by_switches(settings);
  by_switches.join(1'000'000);
  EXPECT_EQ(5, by_switches.address());
  EXPECT_EQ(1'000'000U, by_switches.bitrate());
}

}  // namespace
}  // namespace axisd::yss_c
