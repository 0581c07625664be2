#include "devices/simulation/axis_control.hpp"

#include <gmock/gmock.h>

namespace axisd::simulation {
namespace {

/// A spindle with 100 pulses for each millimetre.
AxisSettings feeder(bool invert = false) {
  AxisSettings axis;
  axis.name = "feeder";
  axis.node = 3;
  axis.scale = {.pulses_per_revolution = 1000, .travel_numerator = 10, .invert = invert, .unit = "mm"};
  axis.inputs = {{.terminal = "X0", .function = "home"},
                 {.terminal = "X2", .function = "negative_limit", .active_low = true}};
  return axis;
}

std::string command(std::string_view words, const AxisSettings& axis = feeder()) {
  const auto made = axis_command(axis, words);
  return made ? *made : "error " + made.error().remedy;
}

TEST(AxisControl, NamesTheNode) {
  EXPECT_EQ(command("power off"), "power 3 off");
  EXPECT_EQ(command("block on"), "block 3 on");
  EXPECT_EQ(command("alarm 2"), "alarm 3 2");
  EXPECT_EQ(command("lose 4"), "fault drop_reply node=3 count=4");
  EXPECT_EQ(command("show"), "shaft 3");
}

TEST(AxisControl, AnInputIsActuatedWhateverItsActiveLevel) {
  EXPECT_EQ(command("input X0 on"), "input 3 X0 on");
  EXPECT_EQ(command("input X2 on"), "input 3 X2 off");
  EXPECT_EQ(command("input X2 off"), "input 3 X2 on");
  EXPECT_EQ(command("input X2 auto"), "input 3 X2 auto");
  EXPECT_EQ(command("input X4 on"), "input 3 X4 on") << "without a function: its level";
}

TEST(AxisControl, PushesInUnitsAndDirectionOfTheAxis) {
  EXPECT_EQ(command("push 1.5"), "push 3 150");
  EXPECT_EQ(command("push -2"), "push 3 -200");
  EXPECT_EQ(command("push 2", feeder(true)), "push 3 -200");
}

TEST(AxisControl, RefusesWhatItDoesNotUnderstand) {
  for (const auto* wrong :
       {"", "jump", "power", "power maybe", "input X0", "input X0 high", "alarm", "alarm x", "push",
        "push 2mm", "push nan", "push 1e300", "lose 0", "lose", "show all"})
    EXPECT_THAT(command(wrong), testing::StartsWith("error ")) << wrong;
}

TEST(AxisControl, AnInputThatTheModelLacksIsRefusedWithThoseThatItHas) {
  auto axis = feeder();
  axis.model = "ess42-r";
  EXPECT_EQ(command("input X9 on", axis), "error it has X0, X1, X2, X3");
  EXPECT_EQ(command("input X3 on", axis), "input 3 X3 on");
}

TEST(AxisControl, ShowsTheLoadWhereItIs) {
  EXPECT_EQ(axis_reply(feeder(), 50, "ok position=-150 moving=0 starts=2"),
            "ok the load is at 48.5 mm, at rest, 2 starts");
  EXPECT_EQ(axis_reply(feeder(true), 0, "ok position=-150 moving=1 starts=2"),
            "ok the load is at 1.5 mm, moving, 2 starts");
  EXPECT_EQ(axis_reply(feeder(), 50, "ok"), "ok");
  EXPECT_EQ(axis_reply(feeder(), 50, "error no node 3"), "error no node 3");
}

}  // namespace
}  // namespace axisd::simulation
