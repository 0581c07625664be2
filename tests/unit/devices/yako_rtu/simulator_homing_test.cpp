// Homing, 7.5: four modes, limits, compensation, starts on a switch, and the switches about them.
#include "tests/unit/devices/yako_rtu/simulator_fixture.hpp"

namespace axisd::yako_rtu {
namespace {

simulation::SimulatedNodeSettings machine() {
  simulation::SimulatedNodeSettings settings;
  settings.mechanics = {.home_switch_from = 2000,
                        .home_switch_to = 2600,
                        .positive_limit_from = 6000,
                        .negative_limit_from = -4000};
  return settings;
}

/// X0 home, X1 positive, X2 negative limit, as in the example of 4.3.
void wire_up(Bench& bench, int mode) {
  bench.assign("X0", Input::home);
  bench.assign("X1", Input::positive_limit);
  bench.assign("X2", Input::negative_limit);
  ASSERT_EQ(0, bench.write(reg::homing_mode, mode));
}

void home(Bench& bench) {
  ASSERT_EQ(0, bench.write(reg::homing_start, 1));
  EXPECT_EQ(1, bench.reg(reg::mode));
  EXPECT_EQ(1, bench.reg(reg::moving));
  for (int i = 0; i < 120 && bench.reg(reg::mode) == 1; ++i) bench.wait(500ms);
}

struct Mode {
  int mode;
  std::int64_t
      home;  ///< where the shaft stands: the first pulse on the switch, coming from the search's side
};
class HomingModes : public ::testing::TestWithParam<Mode> {};

TEST_P(HomingModes, EndOnTheRisingEdgeWithTheCounterAtZero) {
  Bench bench{machine()};
  if (GetParam().mode == 1) {  // searches backwards: from beyond the switch
    bench.move(4000);
    bench.wait(10s);
  }
  wire_up(bench, GetParam().mode);
  EXPECT_FALSE(bench.status(1));
  home(bench);
  EXPECT_TRUE(bench.status(1));
  EXPECT_EQ(0, bench.position());
  EXPECT_EQ(GetParam().home, bench.drive().shaft_pulses());
  EXPECT_EQ(0, bench.reg(reg::moving));
}
INSTANTIATE_TEST_SUITE_P(Manual, HomingModes,
                         ::testing::Values(Mode{0, 2000}, Mode{1, 2600}, Mode{2, 6000}, Mode{3, -4000}));

TEST(SimulatorHoming, PassesTheSwitchLeavesItAndApproachesSlowly) {
  Bench bench{machine()};
  wire_up(bench, 0);
  bench.write(reg::homing_start, 1);
  bool overshot = false, backed = false;
  int approach_speed = 0;
  for (int i = 0; i < 20000 && bench.reg(reg::mode) == 1; ++i) {
    bench.wait(1ms);
    overshot |= bench.drive().shaft_pulses() > 2050;
    backed |= overshot && bench.drive().shaft_pulses() < 2000;
    if (backed && bench.reg(reg::direction) == 0)
      approach_speed = std::max(approach_speed, bench.reg(reg::speed));
  }
  EXPECT_TRUE(overshot);
  EXPECT_TRUE(backed);
  EXPECT_GT(approach_speed, 0);
  EXPECT_LE(approach_speed, 60);
  EXPECT_EQ(2000, bench.drive().shaft_pulses());
}

TEST(SimulatorHoming, FromBeyondTheSwitchTheLimitTurnsItRound) {
  for (const bool same_edge : {false, true}) {
    auto settings = machine();
    settings.switches["homing_same_edge"] = same_edge;
    Bench bench{settings};
    bench.move(4000);
    bench.wait(10s);
    wire_up(bench, 0);
    home(bench);
    EXPECT_TRUE(bench.status(1));
    EXPECT_EQ(same_edge ? 2000 : 2600, bench.drive().shaft_pulses());
    EXPECT_EQ(0, bench.position());
  }
}

TEST(SimulatorHoming, StartedOnTheSwitchItWaitsForARisingEdge) {
  for (const bool accepts : {false, true}) {
    auto settings = machine();
    settings.switches["homing_accepts_active_switch"] = accepts;
    Bench bench{settings};
    bench.move(2300);
    bench.wait(10s);
    wire_up(bench, 0);
    home(bench);
    EXPECT_TRUE(bench.status(1));
    EXPECT_EQ(accepts ? 2000 : 2600, bench.drive().shaft_pulses())
        << "else it came back from the positive limit";
  }
}

TEST(SimulatorHoming, WithoutASwitchItRunsToBothLimitsAndGivesUp) {
  auto settings = machine();
  settings.mechanics.home_switch_from.reset();
  Bench bench{settings};
  wire_up(bench, 0);
  home(bench);
  EXPECT_EQ(0, bench.reg(reg::mode));
  EXPECT_FALSE(bench.status(1));
  settings.switches["homing_never_gives_up"] = true;
  Bench forever{settings};
  wire_up(forever, 0);
  home(forever);
  EXPECT_EQ(1, forever.reg(reg::mode));
  EXPECT_EQ(1, forever.reg(reg::moving));
}

TEST(SimulatorHoming, WithoutLimitsItRunsOn) {
  Bench bench;
  wire_up(bench, 0);
  home(bench);
  EXPECT_EQ(1, bench.reg(reg::mode));
  EXPECT_GT(bench.drive().shaft_pulses(), 100000);
}

TEST(SimulatorHoming, MovesByTheCompensation) {
  for (const bool zero_before : {false, true}) {
    auto settings = machine();
    settings.switches["zero_before_compensation"] = zero_before;
    Bench bench{settings};
    wire_up(bench, 0);
    bench.write(reg::homing_positive_offset, 700);
    bench.write(reg::homing_negative_offset, 200);
    home(bench);
    EXPECT_EQ(2500, bench.drive().shaft_pulses());
    EXPECT_EQ(zero_before ? 500 : 0, bench.position());
    bench.write(reg::homing_positive_offset, 0);
    bench.write(reg::homing_mode, 2);
    home(bench);
    EXPECT_EQ(5800, bench.drive().shaft_pulses());
  }
}

TEST(SimulatorHoming, TheDoneBitOfTheLastTimeStaysBySwitch) {
  for (const bool stays : {false, true}) {
    auto settings = machine();
    settings.switches["homed_stays_during_homing"] = stays;
    Bench bench{settings};
    wire_up(bench, 0);
    home(bench);
    bench.move(-1000);
    bench.wait(5s);
    EXPECT_TRUE(bench.status(1)) << "a move does not clear it";
    bench.write(reg::homing_start, 1);
    EXPECT_EQ(stays, bench.status(1));
    bench.write(reg::stop, 0);
    bench.wait(1s);
    EXPECT_EQ(stays, bench.status(1));
    EXPECT_EQ(0, bench.reg(reg::mode));
  }
}

TEST(SimulatorHoming, AStopEndsItUnlessTheSwitchSaysItIsIgnored) {
  for (const bool ignored : {false, true}) {
    auto settings = machine();
    settings.switches["stop_ignored_in_homing"] = ignored;
    for (const int kind : {0, 1}) {
      Bench bench{settings};
      wire_up(bench, 0);
      bench.write(reg::homing_start, 1);
      bench.wait(300ms);
      EXPECT_EQ(0, bench.write(reg::stop, kind));
      bench.wait(20s);
      EXPECT_EQ(ignored, bench.status(1));
      EXPECT_EQ(0, bench.reg(reg::mode));
    }
  }
}

TEST(SimulatorHoming, BacksOffAtTheSpeedOfItsSwitch) {
  for (const bool fast : {false, true}) {
    auto settings = machine();
    settings.switches["back_off_at_homing_speed"] = fast;
    Bench bench{settings};
    wire_up(bench, 0);
    bench.write(reg::homing_speed, 300);
    bench.write(reg::homing_start, 1);
    int back = 0;
    for (int i = 0; i < 20000 && bench.reg(reg::mode) == 1; ++i) {
      bench.wait(1ms);
      back = std::min<int>(back, static_cast<std::int16_t>(bench.reg(reg::speed)));
    }
    if (fast)
      EXPECT_LT(back, -100);
    else
      EXPECT_GE(back, -60);
  }
}

TEST(SimulatorHoming, WireOnATerminalStaysWhateverItsFunction) {
  auto settings = machine();
  settings.wires["X0"] = {.kind = simulation::SwitchKind::home, .normally_closed = true};
  Bench bench{settings};
  wire_up(bench, 0);
  EXPECT_EQ(1, bench.reg(reg::inputs) >> 2 & 1) << "closed contact, high level active: reads as active";
  bench.write(reg::input_levels, 1 << 2);
  EXPECT_EQ(0, bench.reg(reg::inputs) >> 2 & 1);
  home(bench);
  EXPECT_EQ(2000, bench.drive().shaft_pulses());
  bench.assign("X5", Input::home);
  bench.assign("X0", Input::none);
  bench.wait(1s);
  EXPECT_EQ(0, bench.reg(reg::inputs) >> 7 & 1) << "X5 has no wire";
}

TEST(SimulatorHoming, ByTerminal) {
  Bench bench{machine()};
  wire_up(bench, 0);
  bench.assign("X3", Input::homing);
  bench.pulse("X3");
  EXPECT_EQ(1, bench.reg(reg::mode));
  bench.wait(30s);
  EXPECT_TRUE(bench.status(1));
}

}  // namespace
}  // namespace axisd::yako_rtu
