// The models with an encoder: a blocked shaft, abrupt stops, a load that moves a released shaft; and the same
// for an open loop.
#include "tests/unit/devices/yako_rtu/simulator_fixture.hpp"

namespace axisd::yako_rtu {
namespace {

class ClosedLoop : public ::testing::TestWithParam<std::string_view> {};

TEST_P(ClosedLoop, ABlockedShaftRaisesTheDeviationAlarmUntilAPowerCycle) {
  Bench bench({}, GetParam());
  bench.drive().block_shaft(true);
  bench.move(10'000, true, 60);
  bench.wait(500ms);
  EXPECT_EQ(0, bench.reg(reg::alarm)) << "less than a revolution behind";
  EXPECT_EQ(1, bench.reg(reg::moving));
  EXPECT_FALSE(bench.drive().shaft_moving());
  bench.wait(1s);
  EXPECT_EQ(5, bench.reg(reg::alarm));
  EXPECT_EQ(0, bench.reg(reg::moving));
  EXPECT_EQ(0, bench.drive().shaft_pulses());
  EXPECT_EQ(0, bench.position()) << "the encoder saw nothing move";
  bench.drive().block_shaft(false);
  bench.write(reg::alarm_clear, 1);
  EXPECT_EQ(5, bench.reg(reg::alarm));
  EXPECT_EQ(0, bench.drive().shaft_pulses()) << "it does not jump";
  bench.power_cycle();
  EXPECT_EQ(0, bench.reg(reg::alarm));
  bench.move(10'000, true, 600);
  bench.wait(3s);
  EXPECT_EQ(10'000, bench.drive().shaft_pulses());
  EXPECT_EQ(0, bench.reg(reg::alarm));
}

TEST_P(ClosedLoop, TheAlarmComesAtTheThresholdOf0x0116InEncoderCounts) {
  for (const int resolution : {0, 1}) {
    Bench bench({}, GetParam());
    ASSERT_EQ(0, bench.write(reg::encoder_resolution, resolution));
    ASSERT_EQ(0, bench.write(reg::deviation_threshold, 1000));
    ASSERT_EQ(0, bench.write(reg::start_speed, 60));
    bench.drive().block_shaft(true);
    bench.write_block(reg::start_speed, {60, 0, 0, 60});
    ASSERT_EQ(0, bench.write(reg::start, 2));
    // 1000 pulses/s; 1000 counts are 250 pulses of 1000 lines, 100 of 2500 lines.
    const auto until = resolution == 0 ? 251ms : 101ms;
    bench.wait(until - 1ms);
    EXPECT_EQ(0, bench.reg(reg::alarm));
    bench.wait(1ms);
    EXPECT_EQ(5, bench.reg(reg::alarm));
  }
}

TEST_P(ClosedLoop, ABriefBlockIsCaughtUpWith) {
  Bench bench({}, GetParam());
  bench.move(5000, true, 60);
  bench.drive().block_shaft(true);
  bench.wait(500ms);
  bench.drive().block_shaft(false);
  bench.wait(10s);
  EXPECT_EQ(5000, bench.drive().shaft_pulses());
  EXPECT_EQ(5000, bench.position());
}

TEST_P(ClosedLoop, TheOtherReadingOfThePositionCountsPulses) {
  auto settings = with_switch("position_is_commanded");
  Bench bench(settings, GetParam());
  bench.drive().block_shaft(true);
  bench.move(400);
  bench.wait(3s);
  EXPECT_EQ(400, bench.position());
  EXPECT_EQ(0, bench.drive().shaft_pulses());
}

TEST_P(ClosedLoop, DoesNotSlipUnlessTheLoopIsOpen) {
  for (const bool open : {false, true}) {
    Bench bench(with_switch("abrupt_stop_slips"), GetParam());
    ASSERT_EQ(0, bench.write(reg::loop_mode, open ? 1 : 0));
    bench.velocity(600);
    bench.wait(1s);
    bench.write(reg::stop, 1);
    EXPECT_EQ(open, bench.position() != bench.drive().shaft_pulses());
  }
}

TEST_P(ClosedLoop, OpenItLosesSteps) {
  Bench bench({}, GetParam());
  ASSERT_EQ(0, bench.write(reg::loop_mode, 1));
  bench.drive().block_shaft(true);
  bench.move(3000);
  bench.wait(10s);
  EXPECT_EQ(0, bench.reg(reg::alarm));
  EXPECT_EQ(3000, bench.position());
  EXPECT_EQ(0, bench.drive().shaft_pulses());
}

TEST_P(ClosedLoop, TheLoopModeCountsAtOnceOrFromTheNextPowerUp) {
  for (const bool later : {false, true}) {
    Bench bench(with_switch("loop_mode_from_power_up", later), GetParam());
    bench.write(reg::loop_mode, 1);
    bench.drive().block_shaft(true);
    bench.move(3000);
    bench.wait(10s);
    EXPECT_EQ(later ? 5 : 0, bench.reg(reg::alarm));
  }
}

TEST_P(ClosedLoop, TheCounterFollowsAReleasedShaftUnlessTheSwitchSaysOtherwise) {
  for (const bool frozen : {false, true}) {
    Bench bench(with_switch("released_position_frozen", frozen), GetParam());
    EXPECT_FALSE(bench.drive().push_shaft(100)) << "it is held";
    bench.write(reg::enable, 0);
    EXPECT_TRUE(bench.drive().push_shaft(-700));
    EXPECT_EQ(-700, bench.drive().shaft_pulses());
    EXPECT_EQ(frozen ? 0 : -700, bench.position());
    bench.write(reg::enable, 1);
    bench.move(0, false);
    bench.wait(5s);
    EXPECT_EQ(frozen ? -700 : 0, bench.drive().shaft_pulses());
  }
}

/// Everything that a real encoder does, with 10000 pulses and 4000 counts per revolution.
simulation::SimulatedNodeSettings noisy(int noise) {
  simulation::SimulatedNodeSettings settings;
  settings.encoder = {.noise = noise, .following = 8ms, .quantised = true, .compliance = 4};
  settings.eeprom[reg::microstep] = 13;
  return settings;
}

TEST_P(ClosedLoop, TheCounterIsMeasured) {
  Bench bench(noisy(2), GetParam());
  bench.move(10'000, true, 60);
  bench.wait(600ms);
  const auto commanded = [&] { return bench.drive().shaft_pulses(); };
  EXPECT_NEAR(80, commanded() - bench.position(), 7) << "behind in motion";
  while (bench.reg(reg::moving) == 1) bench.wait(1ms);
  EXPECT_EQ(10'000, bench.drive().shaft_pulses());
  int differs = 0;
  for (int i = 0; i < 100; ++i) {
    bench.wait(5ms);
    if (i >= 20) {
      EXPECT_NEAR(10'000, bench.position(), 6);
      EXPECT_TRUE(bench.status(0));
    }
    differs += bench.position() != 10'000 ? 1 : 0;
  }
  EXPECT_GT(differs, 50);
  bench.write(reg::position_clear, 1);
  EXPECT_NEAR(0, bench.position(), 6);
}

TEST_P(ClosedLoop, InPositionIsWithinTheWindowOf0x011F) {
  auto settings = noisy(0);
  settings.encoder.following = 50ms;
  settings.encoder.compliance = 20;
  Bench bench(settings, GetParam());
  bench.move(10'000, true, 60);
  while (bench.reg(reg::moving) == 1) bench.wait(1ms);
  EXPECT_FALSE(bench.status(0)) << "still settling, off by " << 10'000 - bench.position();
  bench.wait(500ms);
  EXPECT_TRUE(bench.status(0));
  EXPECT_TRUE(bench.drive().lean_on_shaft(11));
  EXPECT_FALSE(bench.status(0)) << "10 counts by default";
  ASSERT_EQ(0, bench.write(reg::positioning_accuracy, 11));
  EXPECT_TRUE(bench.status(0));
}

TEST_P(ClosedLoop, AnOpenLoopHasNoEncoderToShow) {
  Bench bench(noisy(2), GetParam());
  ASSERT_EQ(0, bench.write(reg::loop_mode, 1));
  bench.move(5000, true, 60);
  bench.wait(300ms);
  EXPECT_EQ(bench.drive().shaft_pulses(), bench.position());
  bench.wait(5s);
  for (int i = 0; i < 20; ++i) {
    bench.wait(5ms);
    EXPECT_EQ(5000, bench.position());
    EXPECT_TRUE(bench.status(0));
  }
}

TEST_P(ClosedLoop, ALoadSlipsWhileReleased) {
  auto settings = noisy(0);
  settings.encoder.slip = -1000;
  Bench bench(settings, GetParam());
  bench.wait(1s);
  EXPECT_EQ(0, bench.drive().shaft_pulses()) << "held";
  bench.write(reg::enable, 0);
  bench.wait(1s);
  EXPECT_NEAR(-1000, bench.drive().shaft_pulses(), 2);
  EXPECT_NEAR(-1000, bench.position(), 2);
  bench.write(reg::enable, 1);
  const auto there = bench.drive().shaft_pulses();
  bench.wait(1s);
  EXPECT_EQ(there, bench.drive().shaft_pulses());
}

INSTANTIATE_TEST_SUITE_P(Models, ClosedLoop, ::testing::Values("ssd2608pr", "ess42-r"));

TEST(OpenLoop, ABlockedShaftLosesStepsThatNobodySees) {
  Bench bench;
  bench.drive().block_shaft(true);
  bench.move(3000);
  bench.wait(2s);
  bench.drive().block_shaft(false);
  bench.wait(10s);
  EXPECT_EQ(0, bench.reg(reg::alarm));
  EXPECT_EQ(3000, bench.position());
  EXPECT_TRUE(bench.status(0));
  const auto lost = 3000 - bench.drive().shaft_pulses();
  EXPECT_GT(lost, 1500);
  EXPECT_LT(lost, 2500);
  bench.move(0, false);
  bench.wait(10s);
  EXPECT_EQ(-lost, bench.drive().shaft_pulses()) << "and stays lost";
}

TEST(OpenLoop, CountsItsPulsesExactly) {
  Bench bench(noisy(2));
  EXPECT_EQ(nullptr, bench.drive().encoder());
  bench.move(1000);
  for (int i = 0; i < 300; ++i) {
    bench.wait(5ms);
    EXPECT_EQ(bench.drive().shaft_pulses(), bench.position());
  }
  EXPECT_EQ(1000, bench.position());
}

TEST(OpenLoop, AReleasedShaftMovesUnseen) {
  Bench bench;
  bench.write(reg::enable, 0);
  EXPECT_TRUE(bench.drive().push_shaft(250));
  EXPECT_EQ(0, bench.position());
  EXPECT_EQ(250, bench.drive().shaft_pulses());
  bench.drive().block_shaft(true);
  EXPECT_FALSE(bench.drive().push_shaft(250));
}

TEST(OpenLoop, ABlockedShaftDoesNotReachItsSwitches) {
  simulation::SimulatedNodeSettings settings;
  settings.mechanics.positive_limit_from = 500;
  Bench bench{settings};
  bench.assign("X1", Input::positive_limit);
  bench.drive().block_shaft(true);
  bench.move(2000);
  bench.wait(10s);
  EXPECT_EQ(2000, bench.position());
  EXPECT_EQ(0, bench.reg(reg::inputs));
}

}  // namespace
}  // namespace axisd::yako_rtu
