// Terminals: filter, levels, functions, limits (6.1), PT and PV (7.3, 7.4), outputs.
#include "tests/unit/devices/yako_rtu/simulator_fixture.hpp"

namespace axisd::yako_rtu {
namespace {

constexpr int x(int number) { return 1 << (number + 2); }

TEST(SimulatorTerminals, ShorterPulsesThan10MsAreNotSeen) {
  Bench bench;
  bench.assign("X3", Input::position);
  bench.drive().set_input("X3", true);
  bench.wait(9ms);
  bench.drive().set_input("X3", false);
  bench.wait(1s);
  EXPECT_EQ(0, bench.drive().starts());
  bench.pulse("X3");
  EXPECT_EQ(1, bench.drive().starts());
}

TEST(SimulatorTerminals, UndefinedOnesShowTheirLevelAndDoNothing) {
  Bench bench;
  bench.drive().set_input("PU", true);
  bench.drive().set_input("X7", true);
  bench.wait(20ms);
  EXPECT_EQ(1 | x(7), bench.reg(reg::inputs));
  bench.write(reg::input_levels, x(7) | x(0));
  EXPECT_EQ(1 | x(0), bench.reg(reg::inputs));
  bench.drive().set_input("X7", std::nullopt);
  bench.wait(20ms);
  EXPECT_EQ(1 | x(0) | x(7), bench.reg(reg::inputs)) << "nothing connected is low, which is active here";
}

TEST(SimulatorTerminals, StopAndEmergencyStopEndAnyMotionAndBlockStarts) {
  for (const bool only_edge : {false, true}) {
    for (const auto function : {Input::stop, Input::emergency_stop}) {
      Bench bench{with_switch("stop_terminal_only_edge", only_edge)};
      bench.assign("X0", function);
      bench.velocity(300);
      bench.wait(1s);
      bench.drive().set_input("X0", true);
      bench.wait(11ms);
      EXPECT_EQ(function == Input::stop ? 1 : 0, bench.reg(reg::moving));
      bench.wait(200ms);
      EXPECT_EQ(0, bench.reg(reg::moving));
      bench.velocity(300);
      EXPECT_EQ(only_edge ? 1 : 0, bench.reg(reg::moving));
    }
  }
}

TEST(SimulatorTerminals, PositionMovesAreRelativeOrAbsoluteBy0x0026) {
  Bench bench;
  bench.assign("X1", Input::position);
  bench.write_block(reg::start_speed, {5, 100, 100, 600, 0, 400});
  for (int i = 0; i < 2; ++i) {
    bench.pulse("X1");
    bench.wait(2s);
  }
  EXPECT_EQ(800, bench.position());
  bench.write(reg::terminal_move_mode, 1);
  bench.pulse("X1");
  bench.wait(2s);
  EXPECT_EQ(400, bench.position());
}

TEST(SimulatorTerminals, JogRunsWhileHeld) {
  Bench bench;
  bench.assign("X1", Input::jog_positive);
  bench.assign("X2", Input::jog_negative);
  bench.drive().set_input("X2", true);
  bench.wait(500ms);
  EXPECT_EQ(1, bench.reg(reg::moving));
  EXPECT_LT(bench.position(), -300);
  bench.drive().set_input("X2", false);
  bench.wait(500ms);
  EXPECT_EQ(0, bench.reg(reg::moving));
  bench.drive().set_input("X1", true);
  bench.wait(2s);
  EXPECT_GT(bench.position(), 0);
}

TEST(SimulatorTerminals, SpeedTerminalStartsAndStopsBySwitch) {
  for (const bool level : {false, true}) {
    Bench bench{with_switch("speed_terminal_is_level", level)};
    bench.assign("X1", Input::speed);
    bench.pulse("X1");
    bench.wait(500ms);
    EXPECT_EQ(level ? 0 : 1, bench.reg(reg::moving));
  }
}

TEST(SimulatorTerminals, MotorFreeReleasesWhileActive) {
  Bench bench;
  bench.assign("X4", Input::motor_free);
  bench.velocity(60);
  bench.wait(500ms);
  bench.drive().set_input("X4", true);
  bench.wait(20ms);
  EXPECT_EQ(0, bench.reg(reg::moving));
  EXPECT_TRUE(bench.status(4));
  bench.drive().set_input("X4", false);
  bench.wait(20ms);
  EXPECT_FALSE(bench.status(4));
  EXPECT_EQ(0, bench.reg(reg::moving));
}

TEST(SimulatorTerminals, AlarmClear) {
  Bench bench;
  bench.assign("X4", Input::alarm_clear);
  bench.drive().raise_alarm(4);
  bench.pulse("X4");
  EXPECT_EQ(0, bench.reg(reg::alarm));
}

TEST(SimulatorTerminals, AssigningAnActiveInputActsOnlyBySwitch) {
  for (const bool edges : {false, true}) {
    Bench bench{with_switch("configuration_makes_edges", edges)};
    bench.drive().set_input("X6", true);
    bench.wait(1s);
    bench.assign("X6", Input::jog_positive);
    bench.wait(1s);
    EXPECT_EQ(edges ? 1 : 0, bench.drive().starts());
  }
}

simulation::SimulatedNodeSettings with_limits() {
  simulation::SimulatedNodeSettings settings;
  settings.mechanics.positive_limit_from = 3000;
  settings.mechanics.negative_limit_from = -3000;
  return settings;
}

TEST(SimulatorLimits, BlockTheirDirectionAndLeaveTheOther) {
  for (const int mode : {0, 1}) {
    Bench bench{with_limits()};
    bench.assign("X1", Input::positive_limit);
    bench.assign("X2", Input::negative_limit);
    bench.write(reg::overtravel_stop, mode);
    bench.move(9000);
    bench.wait(10s);
    EXPECT_EQ(3000, bench.position());
    EXPECT_FALSE(bench.status(0));
    bench.move(100);
    EXPECT_EQ(1, bench.drive().starts()) << "not executed";
    bench.velocity(-60);
    bench.wait(10s);
    EXPECT_EQ(-3000, bench.position());
  }
}

TEST(SimulatorLimits, Mode2IgnoresThem) {
  Bench bench{with_limits()};
  bench.assign("X1", Input::positive_limit);
  bench.write(reg::overtravel_stop, 2);
  bench.move(5000);
  bench.wait(10s);
  EXPECT_EQ(5000, bench.position());
}

TEST(SimulatorLimits, FreeStopReleasesAndFiltersApplyBySwitch) {
  auto settings = with_limits();
  settings.switches["free_stop_releases"] = true;
  settings.switches["filter_home_and_limits"] = true;
  Bench bench{settings};
  bench.assign("X1", Input::positive_limit);
  bench.move(9000);
  bench.wait(10s);
  EXPECT_EQ(3010, bench.position()) << "10 ms at 1000 pulses/s";
  EXPECT_TRUE(bench.status(4));
}

/// PINs on X0..X4, PT on X5, PV on X6 and its direction on X7; two segments.
void multi(Bench& bench) {
  for (int i = 0; i < 5; ++i)
    bench.assign("X" + std::to_string(i), static_cast<Input>(static_cast<int>(Input::pin0) + i));
  bench.assign("X5", Input::pt_enable);
  bench.assign("X6", Input::pv_enable);
  bench.assign("X7", Input::pv_direction);
  bench.write_block(reg::segment_pulses_low, {1000, 500});
  bench.write_block(reg::segment_speed, {300, 600});
  bench.write_block(reg::segment_time, {50, 100});
  bench.write_block(reg::segment_pv_speed, {120, 240});
}

TEST(SimulatorMultiPosition, RunsTheSelectedSegment) {
  Bench bench;
  multi(bench);
  bench.pulse("X5");
  EXPECT_EQ(0, bench.drive().starts()) << "no selection";
  bench.drive().set_input("X1", true);  // segment 2
  bench.wait(50ms);
  bench.pulse("X5");
  EXPECT_EQ(2, bench.reg(reg::mode));
  bench.wait(2s);
  EXPECT_EQ(500, bench.position());
  EXPECT_EQ(0, bench.reg(reg::mode));
  EXPECT_TRUE(bench.status(0));
}

TEST(SimulatorMultiPosition, NeedsPinsThatAreStable5MsAroundTheEdge) {
  Bench before;
  multi(before);
  before.drive().set_input("X0", true);
  before.wait(3ms);
  before.pulse("X5");
  before.wait(1s);
  EXPECT_EQ(0, before.drive().starts());
  Bench after;
  multi(after);
  after.drive().set_input("X0", true);
  after.wait(50ms);
  after.drive().set_input("X5", true);
  after.wait(3ms);
  after.drive().set_input("X0", false);
  after.wait(1s);
  EXPECT_EQ(0, after.drive().starts());
}

TEST(SimulatorMultiSpeed, FollowsSelectionAndDirectionWhileEnabled) {
  Bench bench;
  multi(bench);
  bench.drive().set_input("X0", true);
  bench.wait(50ms);
  bench.drive().set_input("X6", true);
  bench.wait(500ms);
  EXPECT_EQ(3, bench.reg(reg::mode));
  EXPECT_EQ(120, bench.reg(reg::speed));
  bench.drive().set_input("X0", false);
  bench.drive().set_input("X1", true);
  bench.wait(500ms);
  EXPECT_EQ(240, bench.reg(reg::speed));
  bench.drive().set_input("X7", true);
  bench.wait(1s);
  EXPECT_EQ(-240, static_cast<std::int16_t>(bench.reg(reg::speed)));
  bench.drive().set_input("X6", false);
  bench.wait(1s);
  EXPECT_EQ(0, bench.reg(reg::moving));
  EXPECT_EQ(0, bench.reg(reg::mode));
}

TEST(SimulatorMultiSpeed, GoesOnWithoutItsEnableBySwitchAndStopsOnCommand) {
  for (const bool ignored : {false, true}) {
    auto settings = with_switch("pv_latched");
    settings.switches["stop_ignored_in_pt_pv"] = ignored;
    Bench bench{settings};
    multi(bench);
    bench.drive().set_input("X0", true);
    bench.wait(50ms);
    bench.pulse("X6");
    bench.wait(1s);
    EXPECT_EQ(120, bench.reg(reg::speed));
    bench.write(reg::stop, 0);
    bench.wait(1s);
    EXPECT_EQ(ignored ? 1 : 0, bench.reg(reg::moving));
  }
}

TEST(SimulatorMultiSpeed, DoesNotBeginAgainAfterAStopWhileEnableIsHeld) {
  Bench bench;
  multi(bench);
  bench.drive().set_input("X0", true);
  bench.wait(50ms);
  bench.drive().set_input("X6", true);
  bench.wait(1s);
  bench.write(reg::stop, 0);
  bench.wait(5s);
  EXPECT_EQ(0, bench.reg(reg::moving));
  EXPECT_EQ(1, bench.drive().starts());
}

TEST(SimulatorOutputs, HaveTheFunctionsAndLevelsOfTheTable) {
  Bench bench;
  bench.write_block(reg::first_output_function, {2, 3, 5, 6});
  EXPECT_EQ(0b0001, bench.reg(reg::outputs));
  bench.move(1000);
  EXPECT_EQ(0b0011, bench.reg(reg::outputs));
  bench.wait(5s);
  EXPECT_EQ(0b0101, bench.reg(reg::outputs));
  EXPECT_TRUE(bench.drive().output_level(2));
  bench.write(reg::output_levels, 0b0110);
  EXPECT_FALSE(bench.drive().output_level(2));
  EXPECT_TRUE(bench.drive().output_level(1));
  bench.write(reg::enable, 0);
  EXPECT_FALSE(bench.drive().output_level(0)) << "the brake closes";
}

}  // namespace
}  // namespace axisd::yako_rtu
