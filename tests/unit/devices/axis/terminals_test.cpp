#include "devices/axis/terminals.hpp"

#include <gtest/gtest.h>

#include <array>

namespace axisd {
namespace {

constexpr std::array<TerminalSpec, 3> inputs{{{.name = "X0"}, {.name = "X1"}, {.name = "X2"}}};
constexpr std::array<TerminalSpec, 1> outputs{{{.name = "Y0"}}};
constexpr std::array<TerminalFunctionSpec, 3> functions{
    {{.name = "stop", .code = 1, .mirror = {}},
     {.name = "jog_positive", .code = 2, .mirror = "jog_negative", .starts_motion = true},
     {.name = "pv_direction", .code = 3, .mirror = {}}}};

DriveSample with(std::uint32_t bits) { return {.asked_at = {}, .measured_at = {}, .inputs = bits}; }

class TerminalsTest : public testing::Test {
 protected:
  TerminalsTest() {
    descriptor_.inputs = inputs;
    descriptor_.outputs = outputs;
    descriptor_.input_functions = functions;
    settings_.inputs = {{.terminal = "X0", .function = "stop"},
                        {.terminal = "X2", .function = "jog_positive"},
                        {.terminal = "PU", .function = "stop"}};  // the drive does not have it
    settings_.outputs = {{.terminal = "Y0", .function = "alarm"}};
  }

  AxisSettings settings_;
  DriveDescriptor descriptor_;
  Terminals terminals_{settings_, descriptor_};
};

TEST_F(TerminalsTest, AFunctionIsThereWhereAnInputIsConfiguredWithIt) {
  EXPECT_TRUE(terminals_.has("stop"));
  EXPECT_FALSE(terminals_.has("quick_stop"));
}

TEST_F(TerminalsTest, ItIsActiveByTheBitOfItsTerminal) {
  EXPECT_TRUE(terminals_.active(with(0b001), "stop"));
  EXPECT_FALSE(terminals_.active(with(0b110), "stop"));
  EXPECT_TRUE(terminals_.active(with(0b100), settings_.inputs[1]));
  EXPECT_FALSE(terminals_.active(with(0b111), settings_.inputs[2])) << "no such terminal";
  EXPECT_FALSE(terminals_.active(with(0b111), "quick_stop"));
}

TEST_F(TerminalsTest, SomeFunctionsStartMotions) {
  EXPECT_FALSE(terminals_.starts_motion(settings_.inputs[0]));
  EXPECT_TRUE(terminals_.starts_motion(settings_.inputs[1]));
  EXPECT_TRUE(terminals_.may_start_motion());
  EXPECT_TRUE(terminals_.start_active(with(0b100)));
  EXPECT_FALSE(terminals_.start_active(with(0b011)));
  settings_.inputs.resize(1);
  EXPECT_FALSE(terminals_.may_start_motion());
}

TEST_F(TerminalsTest, AllAreShownWithTheirFunctions) {
  const auto shown = terminals_.inputs(0b101);
  ASSERT_EQ(shown.size(), 3U);
  EXPECT_EQ(shown[0].name, "X0");
  EXPECT_EQ(shown[0].function, "stop");
  EXPECT_TRUE(shown[0].active);
  EXPECT_EQ(shown[1].function, "");
  EXPECT_FALSE(shown[1].active);
  EXPECT_TRUE(shown[2].active);
  ASSERT_EQ(terminals_.outputs(1).size(), 1U);
  EXPECT_EQ(terminals_.outputs(1)[0].function, "alarm");
  EXPECT_TRUE(terminals_.outputs(1)[0].active);
}

TEST_F(TerminalsTest, AnInvertedAxisShowsItsOwnDirection) {
  settings_.inputs[0].function = "pv_direction";
  EXPECT_TRUE(terminals_.inputs(0b001)[0].active);
  settings_.scale.invert = true;
  EXPECT_FALSE(terminals_.inputs(0b001)[0].active);
  EXPECT_TRUE(terminals_.inputs(0b100)[2].active) << "only that one";
}

}  // namespace
}  // namespace axisd
