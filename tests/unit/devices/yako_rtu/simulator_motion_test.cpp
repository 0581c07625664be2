// Motion profiles (7.1, 7.2), starts and stops (7.6), directions, counter, 200 kHz, and the switches about
// them.
#include "tests/unit/devices/yako_rtu/simulator_fixture.hpp"

namespace axisd::yako_rtu {
namespace {

using simulation::Profile;
using simulation::rates_from;

/// Time until the drive stands still, in steps of 1 ms.
Duration run_out(Bench& bench, Duration at_most = 60s) {
  Duration passed{};
  while (bench.reg(reg::moving) == 1 && passed < at_most) {
    bench.wait(1ms);
    passed += 1ms;
  }
  return passed;
}

TEST(SimulatorProfile, IsATrapezoidOfTheRegistersTimes) {
  // 1000 pulses/rev: 60 r/min is 1000 pulses/s, 5 r/min 83.3; the ramps of 100 ms cover 54.17 pulses each.
  const auto rates = rates_from(5, 60, 100, 100, 1000);
  const auto profile = Profile::move(rates.start, rates, 5000);
  EXPECT_NEAR(0.1 + (5000 - 2 * 54.1667) / 1000 + 0.1, profile.duration(), 1e-6);
  EXPECT_NEAR(54.1667, profile.distance_at(0.1), 1e-3);
  EXPECT_NEAR(541.667, profile.speed_at(0.05), 1e-2);
  EXPECT_NEAR(1000, profile.speed_at(2), 1e-9);
  EXPECT_EQ(5000, profile.distance_at(100));
  EXPECT_EQ(0, profile.speed_at(100));
}

TEST(SimulatorProfile, IsATriangleWhereTheSpeedIsNotReached) {
  const auto rates = rates_from(5, 600, 100, 200, 1000);
  const auto profile = Profile::move(rates.start, rates, 200);
  double peak = 0;
  for (double t = 0; t < profile.duration(); t += 1e-4) peak = std::max(peak, profile.speed_at(t));
  EXPECT_LT(peak, rates.cruise);
  const double up = (peak * peak - rates.start * rates.start) / (2 * rates.acceleration);
  const double down = (peak * peak - rates.start * rates.start) / (2 * rates.deceleration);
  EXPECT_NEAR(200, up + down, 1);
}

TEST(SimulatorProfile, TimeAndDistanceAreInverse) {
  const auto rates = rates_from(5, 300, 100, 150, 1000);
  for (const double distance : {1.0, 37.0, 500.0, 5000.0}) {
    const auto profile = Profile::move(rates.start, rates, 5000);
    EXPECT_NEAR(distance, profile.distance_at(profile.time_at(distance)), 1e-6);
  }
  EXPECT_GT(Profile::move(rates.start, rates, 10).time_at(11), 1e9);
}

TEST(SimulatorMotion, EndsExactlyAtItsTargetAfterThePredictedTime) {
  Bench bench;
  ASSERT_EQ(0, bench.move(5000));
  EXPECT_EQ(1, bench.reg(reg::moving));
  EXPECT_TRUE(bench.status(2));
  EXPECT_FALSE(bench.status(0));
  bench.wait(2s);
  EXPECT_EQ(60, bench.reg(reg::speed));
  const auto rest = run_out(bench);
  EXPECT_NEAR(3.0917, std::chrono::duration<double>(rest).count(), 0.002);
  EXPECT_EQ(5000, bench.position());
  EXPECT_TRUE(bench.status(0));
  EXPECT_EQ(0, bench.reg(reg::mode));
  EXPECT_EQ(1, bench.drive().starts());
}

TEST(SimulatorMotion, RelativeAndAbsoluteTargets) {
  Bench bench;
  bench.move(-1500);
  EXPECT_EQ(1, bench.reg(reg::direction));
  bench.wait(10s);
  EXPECT_EQ(-1500, bench.position());
  bench.move(-1500);
  bench.wait(10s);
  EXPECT_EQ(-3000, bench.position());
  bench.move(2000, false);
  EXPECT_EQ(0, bench.reg(reg::direction));
  bench.wait(10s);
  EXPECT_EQ(2000, bench.position());
  EXPECT_EQ(2000, bench.drive().shaft_pulses());
}

TEST(SimulatorMotion, AnIllegalStepSizeOfTimeDoesNotMatter) {
  Bench coarse, fine;
  coarse.move(777, true, 900);
  fine.move(777, true, 900);
  coarse.wait(130ms);
  for (int i = 0; i < 1300; ++i) fine.wait(100us);
  EXPECT_EQ(coarse.position(), fine.position());
  EXPECT_EQ(coarse.reg(reg::speed), fine.reg(reg::speed));
}

TEST(SimulatorMotion, SpeedModeTurnsEitherWayUntilStopped) {
  Bench bench;
  bench.velocity(-120);
  bench.wait(1s);
  EXPECT_EQ(0x10000 - 120, bench.reg(reg::speed));
  const int before = bench.position();
  bench.write(reg::stop, 0);
  EXPECT_NEAR(100, run_out(bench).count() / 1e6, 2) << "deceleration time";
  EXPECT_NEAR(-104, bench.position() - before, 2) << "(2000 + 83.3) / 2 pulses/s in 0.1 s";
  EXPECT_FALSE(bench.status(0));
}

TEST(SimulatorMotion, EmergencyStopNeedsNoTimeAndZeroIsANormalStop) {
  Bench bench;
  bench.velocity(600);
  bench.wait(1s);
  bench.write(reg::stop, 1);
  EXPECT_EQ(0, bench.reg(reg::moving));
  bench.velocity(600);
  bench.wait(1s);
  bench.write(reg::stop, 2);  // bit 0 alone counts
  EXPECT_EQ(1, bench.reg(reg::moving));
  bench.wait(200ms);
  EXPECT_EQ(0, bench.reg(reg::moving));
}

TEST(SimulatorMotion, AStopUsesTheDecelerationSetBeforeTheStart) {
  for (const bool later : {false, true}) {
    Bench bench{with_switch("stop_uses_new_deceleration", later)};
    bench.velocity(600);
    bench.wait(1s);
    bench.write(reg::deceleration_time, 2000);
    bench.write(reg::stop, 0);
    EXPECT_NEAR(later ? 2000 : 100, run_out(bench).count() / 1e6, 3);
  }
}

TEST(SimulatorMotion, KeepsThePulseRateBelow200kHz) {
  Bench bench;
  bench.write(reg::microstep, 13);  // 10000 pulses/rev: 1200 r/min
  bench.velocity(3000);
  bench.wait(1s);
  EXPECT_EQ(1200, bench.reg(reg::speed));
  Bench fine;
  fine.write(reg::microstep, 15);  // 40000: 300 r/min
  fine.velocity(3000);
  fine.wait(1s);
  EXPECT_EQ(300, fine.reg(reg::speed));
}

TEST(SimulatorMotion, AStartSpeedAboveTheSpeedAndATimeOfZeroAreJumps) {
  Bench bench;
  bench.write_block(reg::start_speed, {300, 100, 100, 60, 0, 1000});
  bench.write(reg::start, 1);
  EXPECT_NEAR(1000, run_out(bench).count() / 1e6, 2);
  bench.write_block(reg::start_speed, {5, 0, 0, 60, 0, 1000});
  bench.write(reg::start, 1);
  EXPECT_NEAR(1000, run_out(bench).count() / 1e6, 2);
  EXPECT_EQ(2000, bench.position());
}

TEST(SimulatorMotion, CounterWrapsAt32Bits) {
  Bench bench;
  bench.write(reg::microstep, 15);
  for (int i = 0; i < 2; ++i) {
    bench.move(0x7FFFFFFF, true, 3000);
    bench.wait(3h);
  }
  EXPECT_EQ(-2, bench.position());
  EXPECT_EQ(2LL * 0x7FFFFFFF, bench.drive().shaft_pulses());
}

TEST(SimulatorMotion, PositionClearIsIgnoredWhileMovingUnlessTheSwitchSaysOtherwise) {
  for (const bool cleared : {false, true}) {
    Bench bench{with_switch("position_clear_in_motion", cleared)};
    bench.move(5000);
    bench.wait(2s);
    const int before = bench.position();
    bench.write(reg::position_clear, 1);
    EXPECT_EQ(cleared ? 0 : before, bench.position());
    bench.wait(10s);
    EXPECT_EQ(cleared ? 5000 - before : 5000, bench.position());
    bench.write(reg::position_clear, 0);
    EXPECT_NE(0, bench.position());
    bench.write(reg::position_clear, 1);
    EXPECT_EQ(0, bench.position());
    EXPECT_EQ(5000, bench.drive().shaft_pulses());
  }
}

TEST(SimulatorMotion, AStartWhileMovingIsIgnoredByDefault) {
  Bench bench;
  bench.move(5000);
  bench.wait(1s);
  EXPECT_EQ(0, bench.move(-100));
  bench.wait(20s);
  EXPECT_EQ(5000, bench.position());
  EXPECT_EQ(1, bench.drive().starts());
}

TEST(SimulatorMotion, AStartWhileMovingIsRefusedByItsSwitch) {
  Bench bench{with_switch("start_in_motion_refused")};
  bench.move(5000);
  bench.wait(1s);
  EXPECT_EQ(6, bench.move(-100));
  EXPECT_EQ(6, bench.write(reg::homing_start, 1));
}

TEST(SimulatorMotion, AStartWhileMovingTakesOverByItsSwitch) {
  Bench bench{with_switch("start_in_motion")};
  bench.move(5000);
  bench.wait(1s);
  bench.move(8000, false, 120);
  bench.wait(500ms);
  EXPECT_EQ(120, bench.reg(reg::speed)) << "goes on, faster";
  bench.move(1000, false, 60);  // behind: brakes, comes back
  bench.wait(20s);
  EXPECT_EQ(1000, bench.position());
  EXPECT_EQ(3, bench.drive().starts());
  bench.velocity(300);
  bench.wait(500ms);
  bench.velocity(-300);
  bench.wait(1s);
  EXPECT_EQ(-300, static_cast<std::int16_t>(bench.reg(reg::speed)));
}

TEST(SimulatorMotion, ARelativeStartThatTakesOverCountsFromWhereItsSwitchSays) {
  for (const bool from_target : {false, true}) {
    auto settings = with_switch("start_in_motion");
    settings.switches["start_in_motion_from_target"] = from_target;
    Bench bench{settings};
    bench.move(5000);
    bench.wait(1s);
    const int here = bench.position();
    bench.move(1000);
    bench.wait(20s);
    EXPECT_EQ(from_target ? 6000 : here + 1000, bench.position());
  }
}

TEST(SimulatorMotion, ReservedStartCodesDoNothingUnlessTheirSwitchesSayOtherwise) {
  Bench bench;
  for (const int code : {0, 3, 4}) EXPECT_EQ(0, bench.write(reg::start, code));
  EXPECT_EQ(7, bench.write(reg::start, 7));
  EXPECT_EQ(0, bench.drive().starts());
  EXPECT_EQ(0, bench.write(reg::start, 6)) << "speed: bit 2 has no meaning there";
  EXPECT_EQ(1, bench.drive().starts());
  Bench refusing{with_switch("reserved_start_refused")};
  for (const int code : {0, 3, 4}) EXPECT_EQ(7, refusing.write(reg::start, code));
  Bench moving{with_switch("reserved_start_moves")};
  moving.write(reg::start, 3);
  EXPECT_EQ(1, moving.drive().starts());
}

TEST(SimulatorMotion, AStartInOneFrameIsASwitch) {
  const std::vector<int> frame{5, 100, 100, 60, 0, 100, 1, 5};
  Bench starting;
  EXPECT_EQ(0, starting.write_block(reg::start_speed, frame));
  EXPECT_EQ(1, starting.drive().starts());
  EXPECT_EQ(1, starting.reg(reg::terminal_move_mode));
  Bench ignoring{with_switch("one_frame_start", false)};
  EXPECT_EQ(0, ignoring.write_block(reg::start_speed, frame));
  EXPECT_EQ(0, ignoring.drive().starts());
  EXPECT_EQ(60, ignoring.reg(reg::maximum_speed)) << "the rest of it counts";
  EXPECT_EQ(0, ignoring.write_block(reg::start, {5})) << "by itself it is a start in any frame";
  EXPECT_EQ(1, ignoring.drive().starts());
  for (const bool partial : {false, true}) {
    auto settings = with_switch("one_frame_start_refused");
    settings.switches["partial_block_write"] = partial;
    Bench refusing{settings};
    EXPECT_EQ(6, refusing.write_block(reg::start_speed, frame));
    EXPECT_EQ(0, refusing.drive().starts());
    EXPECT_EQ(partial ? 100 : 5000, refusing.reg(reg::pulses_low));
  }
}

TEST(SimulatorMotion, AReleasedMotorDoesNotStartAndOneReleasedInMotionStops) {
  Bench bench;
  bench.velocity(60);
  bench.wait(1s);
  bench.write(reg::enable, 0);
  EXPECT_EQ(0, bench.reg(reg::moving));
  EXPECT_TRUE(bench.status(4)) << "inverted: 1 is released";
  EXPECT_EQ(0, bench.move(100));
  EXPECT_EQ(1, bench.drive().starts());
  bench.write(reg::enable, 1);
  EXPECT_FALSE(bench.status(4));
  bench.wait(1s);
  EXPECT_EQ(0, bench.reg(reg::moving)) << "nothing resumes";
  Bench refusing{with_switch("start_refused_when_disabled")};
  refusing.write(reg::enable, 0);
  EXPECT_EQ(6, refusing.move(100));
  EXPECT_EQ(6, refusing.write(reg::homing_start, 1));
}

TEST(SimulatorMotion, InPositionAndSpeedSwitches) {
  for (const bool on : {false, true}) {
    auto settings = with_switch("in_position_after_stop", on);
    settings.switches["in_position_at_power_up"] = on;
    settings.switches["unsigned_speed"] = on;
    Bench bench{settings};
    EXPECT_EQ(on, bench.status(0));
    bench.velocity(-60);
    bench.wait(1s);
    EXPECT_FALSE(bench.status(0));
    EXPECT_EQ(on ? 60 : 0x10000 - 60, bench.reg(reg::speed));
    bench.write(reg::stop, 0);
    bench.wait(1s);
    EXPECT_EQ(on, bench.status(0));
  }
}

TEST(SimulatorMotion, AbruptStopsSlipByTheirSwitch) {
  for (const bool slips : {false, true}) {
    Bench bench{with_switch("abrupt_stop_slips", slips)};
    bench.velocity(600);
    bench.wait(1s);
    bench.write(reg::stop, 1);
    EXPECT_EQ(slips ? 100 : 0, bench.drive().shaft_pulses() - bench.position());
  }
}

TEST(SimulatorMotion, ExternalPulseControlFromTheNextPowerUpIgnoresTheBus) {
  Bench bench;
  bench.write(reg::control_mode, 1);
  bench.move(10);
  bench.wait(1s);
  EXPECT_EQ(10, bench.position());
  bench.power_cycle();
  bench.move(10);
  bench.wait(1s);
  EXPECT_EQ(0, bench.position());
}

TEST(SimulatorMotion, LivesThroughAHundredThousandSteps) {
  Bench bench;
  std::int64_t expected = 0;
  for (int i = 0; i < 1000; ++i) {
    const int pulses = (i * 37 % 101) - 50;
    bench.move(pulses, true, 600);
    for (int step = 0; step < 100; ++step) bench.wait(5ms);
    expected += pulses;
    ASSERT_EQ(expected, bench.position());
  }
}

}  // namespace
}  // namespace axisd::yako_rtu
