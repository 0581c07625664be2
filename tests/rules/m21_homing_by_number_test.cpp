// M18 and M21 with a homing method by its number: the drive homes by itself, with whatever switches it has.
#include <gtest/gtest.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>

#include "devices/axis/planner.hpp"
#include "tests/rules/m23_can_rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

/// A drive that shows no inputs, and an axis without any.
CanRigOptions homes_by(std::int8_t number, bool invert = false) {
  CanRigOptions options{.model = "cia402", .invert = invert};
  options.adjust = [number](AxisSettings& axis) {
    axis.model_settings["objects.60FDh:00.access"] = std::string("none");
    const auto* model = find_drive_model("cia402");
    auto made = model->specialise(*model, axis.model_settings);
    if (!made) throw std::invalid_argument(to_string(made.error()));
    axis.own_descriptor = *made;
    axis.inputs.clear();
    axis.homing = HomingSettings{
        .velocity = 80, .search_velocity = 4, .position = 3, .timeout = 100s, .number = number};
  };
  return options;
}

TEST(M21, AMethodByItsNumberIsWhatTheDriveIsTold) {
  // Each with the one that does the same in the other direction.
  const std::pair<int, int> methods[] = {{17, 18}, {18, 17}, {24, 28}, {28, 24},
                                         {25, 29}, {29, 25}, {35, 35}, {37, 37}};
  for (const auto& [number, mirror] : methods)
    for (const bool invert : {false, true}) {
      SCOPED_TRACE(number);
      CanRig rig(homes_by(static_cast<std::int8_t>(number), invert));
      rig.done(EnableRequest{});
      const auto before = rig.shaft();
      for (int turn = 0; turn < 2; ++turn) {  // the second time from where it stands already
        const auto home = rig.complete(HomeRequest{}, 200s);
        EXPECT_EQ(home.state, CommandState::done) << describe(home);
        EXPECT_EQ(rig.state()->trust, PositionTrust::homed);
      }
      const auto told = rig.writes_of(0x609800);
      ASSERT_FALSE(told.empty());
      for (const auto value : told)
        EXPECT_EQ(static_cast<int>(value & 0xFFU), invert ? mirror : number) << "inverted " << invert;
      if (number >= 35) EXPECT_NEAR(static_cast<double>(rig.shaft()), static_cast<double>(before), 3);
      const double away = number == 18 ? 0 : 20;  // from home at 3, and from the limit switch
      rig.done(MoveAbsoluteRequest{.position = away});
      EXPECT_NEAR(rig.state()->position, away, 0.2);
    }
}

TEST(M21, ANumberThatTheDriveRefusesMovesNothing) {
  for (const std::int8_t number : {std::int8_t{-5}, std::int8_t{33}}) {
    CanRig rig(homes_by(number));
    rig.done(EnableRequest{});
    const auto before = rig.shaft();
    const auto starts = rig.drive->starts();
    const auto home = rig.complete(HomeRequest{});
    EXPECT_EQ(home.state, CommandState::error) << describe(home);
    EXPECT_NE(rig.state()->trust, PositionTrust::homed);
    EXPECT_EQ(rig.drive->starts(), starts);
    EXPECT_NEAR(static_cast<double>(rig.shaft()), static_cast<double>(before), 3);
  }
}

/// It takes the method, searches between its limits for a switch that is not there, and says so (bit 13).
TEST(M21, ANumberByWhichTheDriveFailsIsNoHome) {
  for (const bool polled : {false, true}) {
    auto options = homes_by(24);
    options.polled = polled;
    options.adjust_drive = [](simulation::SimulatedNodeSettings& drive) {
      drive.mechanics = {.positive_limit_from = 3000, .negative_limit_from = -3000};
    };
    CanRig rig(std::move(options));
    rig.done(EnableRequest{});
    const auto starts = rig.drive->starts();
    const auto home = rig.complete(HomeRequest{}, 200s);
    EXPECT_EQ(rig.drive->starts(), starts + 1) << "it was taken";
    EXPECT_EQ(home.state, CommandState::error) << describe(home);
    ASSERT_TRUE(home.cause);
    EXPECT_EQ(home.cause->reason, Reason::not_reached) << describe(home);
    EXPECT_NE(rig.state()->trust, PositionTrust::homed);
    rig.run(2s);
    EXPECT_FALSE(rig.drive->shaft_moving());
    EXPECT_EQ(rig.drive->starts(), starts + 1);
  }
}

TEST(M18, ANumberThatCannotBeMirroredIsRefused) {
  for (const auto& [number, invert, good] : {std::tuple(-5, false, true), std::tuple(-5, true, false),
                                             std::tuple(17, true, true), std::tuple(0, false, false)}) {
    AxisSettings axis{.name = "feeder", .bus = "can0", .node = 5, .model = "cia402"};
    axis.scale = {.pulses_per_revolution = 1000, .travel_numerator = 10, .invert = invert, .unit = "mm"};
    axis.limits.velocity = 100;
    axis.model_settings = {{"eds", in_source_tree("config/examples/standard-drive.eds")},
                           {"velocity_unit", std::string("pulses_per_second")}};
    homes_by(static_cast<std::int8_t>(number)).adjust(axis);
    EXPECT_EQ(drive_setup(axis, *descriptor_of(axis)).has_value(), good) << number << ' ' << invert;
  }
}

}  // namespace
}  // namespace axisd::test
