// What differs between the models: registers, terminals, outputs, microstep, segments, alarms, and the
// readings of their manuals.
#include "tests/unit/devices/yako_rtu/simulator_fixture.hpp"

namespace axisd::yako_rtu {
namespace {

constexpr std::string_view models[] = {"ykd2405pr", "ssd2608pr", "ess42-r"};

struct Layout {
  std::string_view model;
  std::vector<std::string_view> inputs;
  std::uint16_t first_function, first_filter;
  std::size_t unfiltered;
  std::vector<std::uint16_t> holes;
  std::uint16_t last;
};

class Layouts : public ::testing::TestWithParam<Layout> {};

simulation::SimulatedNodeSettings with_home_at(std::int64_t from, std::int64_t to) {
  simulation::SimulatedNodeSettings settings;
  settings.mechanics = {.home_switch_from = from, .home_switch_to = to};
  return settings;
}

TEST_P(Layouts, TheRegistersEndAndHaveHolesWhereTheTableSays) {
  const auto& layout = GetParam();
  Bench bench({}, layout.model);
  EXPECT_EQ(0, bench.read(layout.last));
  EXPECT_EQ(4, bench.read(static_cast<std::uint16_t>(layout.last + 1)));
  EXPECT_EQ(4, bench.write(0xFF00, 11));
  for (const auto hole : layout.holes) EXPECT_EQ(3, bench.read(hole)) << hole;
}

TEST_P(Layouts, EachTerminalHasItsBitAndFunctionAndBothActiveLevels) {
  const auto& layout = GetParam();
  for (std::size_t i = 0; i < layout.inputs.size(); ++i) {
    SCOPED_TRACE(layout.inputs[i]);
    for (const bool inverted : {false, true}) {
      Bench bench({}, layout.model);
      ASSERT_EQ(0, bench.write(reg::input_levels, inverted ? 1 << i : 0));
      ASSERT_EQ(0, bench.write(static_cast<std::uint16_t>(layout.first_function + i),
                               static_cast<int>(Input::speed)));
      bench.drive().set_input(layout.inputs[i], inverted);
      bench.wait(20ms);
      EXPECT_EQ(0, bench.reg(reg::inputs));
      bench.drive().set_input(layout.inputs[i], !inverted);
      bench.wait(20ms);
      EXPECT_EQ(1 << i, bench.reg(reg::inputs));
      EXPECT_EQ(1, bench.drive().starts()) << "the function acts";
    }
  }
}

TEST_P(Layouts, AVirtualSwitchIsWiredToWhicheverTerminalHasItsFunctionWithEitherLevel) {
  const auto& layout = GetParam();
  for (std::size_t i = 0; i < layout.inputs.size(); ++i) {
    SCOPED_TRACE(layout.inputs[i]);
    for (const int levels : {0, 0xFFFF}) {
      Bench bench(with_home_at(300, 400), layout.model);
      ASSERT_EQ(0, bench.write(reg::input_levels, levels));
      ASSERT_EQ(0, bench.write(static_cast<std::uint16_t>(layout.first_function + i),
                               static_cast<int>(Input::home)));
      bench.wait(20ms);
      EXPECT_EQ(0, bench.reg(reg::inputs) >> i & 1) << "away from the switch";
      bench.move(350);
      bench.wait(3s);
      EXPECT_EQ(1, bench.reg(reg::inputs) >> i & 1) << "on the switch";
    }
  }
}

TEST_P(Layouts, FiltersAreSharedByTwoInputs) {
  const auto& layout = GetParam();
  for (std::size_t i = 0; i < layout.inputs.size(); ++i) {
    SCOPED_TRACE(layout.inputs[i]);
    Bench bench({}, layout.model);
    if (i >= layout.unfiltered) {
      const auto filter = layout.first_filter + (i - layout.unfiltered) / 2;
      ASSERT_EQ(0, bench.write(static_cast<std::uint16_t>(filter), 100));
    }
    bench.drive().set_input(layout.inputs[i], true);
    bench.wait(99ms);
    EXPECT_EQ(i < layout.unfiltered ? 1 : 0, bench.reg(reg::inputs) >> i & 1);
    bench.wait(2ms);
    EXPECT_EQ(1, bench.reg(reg::inputs) >> i & 1);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Manual, Layouts,
    ::testing::Values(Layout{.model = "ykd2405pr",
                             .inputs = {"PU", "DR", "X0", "X1", "X2", "X3", "X4", "X5", "X6", "X7"},
                             .first_function = 0x0041,
                             .first_filter = 0x0116,
                             .unfiltered = 2,
                             .holes = {0x000D, 0x0019, 0x002D, 0x0037, 0x0050, 0x00D0, 0x00F0},
                             .last = 0x0119},
                      Layout{.model = "ssd2608pr",
                             .inputs = {"X0", "X1", "X2", "X3", "X4"},
                             .first_function = 0x0041,
                             .first_filter = 0x0137,
                             .unfiltered = 0,
                             .holes = {0x0018, 0x0019, 0x0046, 0x0047, 0x004A, 0x004F, 0x00D0},
                             .last = 0x0139},
                      Layout{.model = "ess42-r",
                             .inputs = {"X0", "X1", "X2", "X3"},
                             .first_function = 0x0043,
                             .first_filter = 0x0137,
                             .unfiltered = 0,
                             .holes = {0x0018, 0x0041, 0x0042, 0x0047, 0x004E, 0x004F, 0x00D0},
                             .last = 0x0139}),
    [](const auto& instance) { return std::string(instance.param.model.substr(0, 3)); });

TEST(SimulatorModels, OutputsHaveTheFunctionsOfTheirTable) {
  struct Case {
    std::string_view model;
    int outputs;
    std::array<int, 6> while_moving;  ///< state of a Y0 with function 1..6
  };
  // Alarm, brake, moving, homed, in position, PT; without a brake all move up.
  for (const auto& [model, outputs, while_moving] :
       {Case{"ykd2405pr", 4, {0, 1, 1, 0, 0, 0}}, Case{"ssd2608pr", 3, {0, 1, 0, 0, 0, 0}},
        Case{"ess42-r", 2, {0, 1, 0, 0, 0, 0}}}) {
    SCOPED_TRACE(model);
    Bench bench({}, model);
    bench.velocity(60);
    for (std::size_t code = 1; code <= 6; ++code) {
      bench.write(reg::first_output_function, static_cast<int>(code));
      EXPECT_EQ(while_moving[code - 1], bench.reg(reg::outputs)) << code;
    }
    EXPECT_EQ(0, bench.write(static_cast<std::uint16_t>(reg::first_output_function + outputs - 1), 1));
    EXPECT_NE(0, bench.write(static_cast<std::uint16_t>(reg::first_output_function + outputs), 1));
    bench.drive().raise_alarm(1);
    bench.write(reg::first_output_function, 1);
    EXPECT_EQ(1 | 1 << (outputs - 1), bench.reg(reg::outputs));
  }
}

TEST(SimulatorModels, InPositionIsFiveOnOneAndFourOnTheOthers) {
  for (const auto model : models) {
    Bench bench({}, model);
    bench.move(10);
    bench.wait(1s);
    bench.write(reg::first_output_function, model == "ykd2405pr" ? 5 : 4);
    EXPECT_EQ(1, bench.reg(reg::outputs)) << model;
  }
}

TEST(SimulatorModels, MicrostepCodesAreTheModels) {
  for (const auto model : models)
    for (const auto& [code, steps] :
         {std::pair{0, model == "ykd2405pr" ? 200 : 400}, std::pair{7, model == "ykd2405pr" ? 25600 : 51200},
          std::pair{8, 1000}, std::pair{15, 40000}}) {
      Bench bench({}, model);
      bench.write(reg::microstep, code);
      bench.write_block(reg::start_speed, {60, 0, 0, 60});
      bench.write(reg::start, 2);
      bench.wait(2s);  // 60 r/min
      EXPECT_EQ(2 * steps, bench.drive().shaft_pulses()) << model << ' ' << code;
    }
}

TEST(SimulatorModels, SegmentsOfTheIntegratedOneEndAtSeven) {
  for (const bool more : {false, true})
    for (const int pin : {18, 19}) {  // PIN2 is segment 4, PIN3 is segment 8
      Bench bench(with_switch("more_than_7_segments", more), "ess42-r");
      bench.assign("X0", Input::pt_enable);
      bench.assign("X1", static_cast<Input>(pin));
      const auto segment = static_cast<std::uint16_t>(pin == 18 ? 3 : 7);
      bench.write(static_cast<std::uint16_t>(reg::segment_pulses_low + segment), 500);
      bench.write(static_cast<std::uint16_t>(reg::segment_speed + segment), 300);
      bench.drive().set_input("X1", true);
      bench.wait(50ms);
      bench.pulse("X0");
      bench.wait(5s);
      EXPECT_EQ(pin == 18 || more ? 500 : 0, bench.drive().shaft_pulses());
    }
}

TEST(SimulatorModels, TheClosedLoopOnesHaveNoPulseInput) {
  Bench bench({}, "ssd2608pr");
  EXPECT_EQ(3, bench.read(reg::control_mode));
  bench.move(100);
  bench.wait(1s);
  EXPECT_EQ(100, bench.position());
}

TEST(SimulatorModels, AlarmsAreThoseOfChapter8) {
  for (const auto model : models) {
    const std::vector<int> expected =
        model == "ess42-r" ? std::vector{1, 2, 3, 5} : std::vector{1, 2, 3, 4, 5};
    Bench bench({}, model);
    EXPECT_THAT(bench.drive().alarms(), ::testing::ElementsAreArray(expected)) << model;
    EXPECT_EQ(model == "ykd2405pr" ? 0x0301 : 0x0305, bench.reg(reg::model));
  }
}

TEST(SimulatorModels, OneAlarmDoesNotHideAnotherThatStays) {
  Bench bench;
  bench.drive().raise_alarm(1);
  bench.drive().raise_alarm(2);
  EXPECT_EQ(1, bench.reg(reg::alarm));
  bench.drive().raise_alarm(0);
  EXPECT_EQ(1, bench.reg(reg::alarm)) << "until the next power-up";
  bench.drive().raise_alarm(3);
  bench.power_cycle();
  EXPECT_EQ(3, bench.reg(reg::alarm)) << "the supply is still low";
}

/// From 4000 back to a switch at 2000..2600 (wide) or 2600 (narrow, passed while braking).
std::int64_t home_mode_1(std::string_view model, simulation::SimulatedNodeSettings settings) {
  Bench bench(std::move(settings), model);
  bench.move(4000, true, 600);
  bench.wait(5s);
  bench.assign("X0", Input::home);
  bench.write(reg::homing_mode, 1);
  bench.write(reg::homing_start, 1);
  for (int i = 0; i < 240 && bench.reg(reg::mode) == 1; ++i) bench.wait(500ms);
  EXPECT_TRUE(bench.status(1));
  EXPECT_EQ(0, bench.position());
  return bench.drive().shaft_pulses();
}

TEST(SimulatorModels, HomingMode1EndsForwardsOrAsItSearched) {
  // The models' own readings, then the other's.
  EXPECT_EQ(2600, home_mode_1("ykd2405pr", with_home_at(2000, 2600)));
  EXPECT_EQ(2600, home_mode_1("ykd2405pr", with_home_at(2599, 2600)));
  auto other = with_home_at(2000, 2600);
  other.switches["homing_mode_1_final_approach_forwards"] = true;
  EXPECT_EQ(2000, home_mode_1("ykd2405pr", other));
  for (const auto model : {"ssd2608pr", "ess42-r"}) {
    EXPECT_EQ(2000, home_mode_1(model, with_home_at(2000, 2600)));
    EXPECT_EQ(2599, home_mode_1(model, with_home_at(2599, 2600)));
    auto same = with_home_at(2000, 2600);
    same.switches["homing_mode_1_final_approach_same"] = true;
    EXPECT_EQ(2600, home_mode_1(model, same));
    auto edge = with_home_at(2000, 2600);
    edge.switches["homing_mode_1_either_edge"] = true;
    EXPECT_EQ(2601, home_mode_1(model, edge)) << "forwards off the switch on which it had stopped";
  }
}

TEST(SimulatorModels, HomingMode1TurnsAtTheLimitAndStillEndsForwards) {
  for (const bool same_edge : {false, true}) {
    auto settings = with_home_at(2000, 2600);
    settings.mechanics.negative_limit_from = -1000;
    settings.switches["homing_same_edge"] = same_edge;
    Bench bench(settings, "ssd2608pr");
    bench.assign("X0", Input::home);
    bench.assign("X2", Input::negative_limit);
    bench.write(reg::homing_mode, 1);
    bench.write(reg::homing_start, 1);
    for (int i = 0; i < 240 && bench.reg(reg::mode) == 1; ++i) bench.wait(500ms);
    EXPECT_TRUE(bench.status(1));
    EXPECT_EQ(2000, bench.drive().shaft_pulses());
  }
}

TEST(SimulatorReadings, TheInputFunctionsOfSsd2608prMayBeWhere43WritesThem) {
  Bench bench(with_switch("input_functions_at_0043"), "ssd2608pr");
  EXPECT_EQ(3, bench.read(0x0041));
  EXPECT_EQ(3, bench.write(0x0042, 1));
  EXPECT_EQ(0, bench.read(0x0043, 5));
  EXPECT_EQ(3, bench.read(0x0048));
  ASSERT_EQ(0, bench.write(0x0043, static_cast<int>(Input::speed)));
  bench.drive().set_input("X0", true);
  bench.wait(50ms);
  EXPECT_EQ(1, bench.drive().starts());
  bench.write(reg::parameter_setting, 1);
  EXPECT_EQ(0, bench.reg(0x0043)) << "the factory's setting is found there, too";
}

TEST(SimulatorReadings, InputFunctionsMayBeUndefinedAfterEachPowerUp) {
  for (const auto model : models)
    for (const bool undefined : {false, true}) {
      Bench bench(with_switch("inputs_undefined_at_power_up", undefined), model);
      bench.assign("X1", Input::home);
      bench.write(reg::homing_mode, 2);
      bench.power_cycle();
      EXPECT_EQ(2, bench.reg(reg::homing_mode));
      const auto address = model == "ykd2405pr" ? 0x0044 : model == "ess42-r" ? 0x0044 : 0x0042;
      EXPECT_EQ(undefined ? 0 : 1, bench.reg(static_cast<std::uint16_t>(address))) << model;
    }
}

TEST(SimulatorReadings, CommandsMayBeReadableButNotTheStart) {
  for (const auto model : models) {
    Bench refused({}, model), readable(with_switch("commands_readable"), model);
    for (const std::uint16_t address : {reg::stop, reg::enable, reg::position_clear, reg::homing_start}) {
      EXPECT_EQ(6, refused.read(address));
      EXPECT_EQ(0, readable.read(address));
      EXPECT_EQ(0, readable.reg(address));
    }
    EXPECT_EQ(6, readable.read(reg::start)) << "the example of 6.2.4";
  }
}

TEST(SimulatorReadings, TheOvertravelModeIsSavedWhereItIsPrintedSo) {
  const auto kept = [](std::string_view model, simulation::SimulatedNodeSettings settings) {
    Bench bench(std::move(settings), model);
    bench.write(reg::overtravel_stop, 2);
    bench.power_cycle();
    return bench.reg(reg::overtravel_stop) == 2;
  };
  EXPECT_TRUE(kept("ykd2405pr", {}));
  EXPECT_FALSE(kept("ssd2608pr", {}));
  EXPECT_FALSE(kept("ess42-r", {}));
  EXPECT_TRUE(kept("ess42-r", with_switch("overtravel_stop_saved")));
}

}  // namespace
}  // namespace axisd::yako_rtu
