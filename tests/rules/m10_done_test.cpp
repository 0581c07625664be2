// M10: where nothing had to be sent, a terminal may have moved the axis since it was seen at its target.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/rules/m22_group_rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

void jogs_by_terminal(AxisSettings& axis) {
  axis.inputs.push_back({.terminal = "X4", .function = "jog_positive"});
}

/// The members' starts take their time: a member that rests at its target was read before all of them.
TEST(M10Done, IsNotToldOfAMemberThatATerminalMovesMeanwhile) {
  for (auto jogged_at = 900ms;; jogged_at += 80ms) {
    SCOPED_TRACE(jogged_at.count());
    GroupRig rig({.baud = 9600,
                  .more_serial_axes = 4,
                  .serial_switches = {{"enabled_at_power_up", false}},
                  .adjust = [](AxisSettings& axis) {
                    if (axis.name == "x") jogs_by_terminal(axis);
                  }});
    const auto run =
        rig.move(GroupRig::to({{"x", 0}, {"y", 20}, {"a", 20}, {"b", 20}, {"c", 20}, {"d", 20}}));
    const auto x = [&] {
      const auto members = run->value().members;
      return std::ranges::find(members, "x", [](const auto& member) { return member.command.axis; })
          ->command.state;
    };
    rig.run(jogged_at);
    if (ended(x())) return;
    rig.serial(0).set_input("X4", true);
    ASSERT_TRUE(rig.run_until([&] { return ended(x()); }, 20s));
    if (x() == CommandState::done) EXPECT_NEAR(rig.load_mm("x"), 0, 0.2) << "what a reading takes";
    rig.serial(0).set_input("X4", false);
    rig.run(2s);
    ASSERT_LT(jogged_at, 10s) << "the move does not end";
  }
}

}  // namespace
}  // namespace axisd::test
