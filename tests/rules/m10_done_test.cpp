// M10: a terminal may have moved the axis since it was seen at its target.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/rules/m22_group_rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

void jogs_by_terminal(AxisSettings& axis) {
  axis.inputs.push_back({.terminal = "X4", .function = "jog_positive"});
}

/// The counter 0 is what a restarted drive shows, too: the canary has to be read before Done.
TEST(M10Done, IsNotToldOfAnAxisThatATerminalMovesBeforeItIsProven) {
  both_directions({.switches = {{"enabled_at_power_up", false}}, .adjust = jogs_by_terminal},
                  [](const RigOptions& options) {
                    Rig rig(options);
                    rig.ready();
                    ASSERT_EQ(rig.complete(MoveAbsoluteRequest{.position = 5}).state, CommandState::done);
                    const auto back = rig.submit(MoveAbsoluteRequest{.position = 0});
                    ASSERT_TRUE(rig.run_until([&] { return rig.drive->shaft_moving(); }, 2s));
                    rig.fault({.kind = simulation::FaultKind::drop_reply,
                               .function = 0x03,
                               .register_address = 0x0020,
                               .count = -1});
                    ASSERT_TRUE(rig.run_until([&] { return !rig.drive->shaft_moving(); }, 2s));
                    rig.run(30ms);
                    ASSERT_FALSE(ended(back->value().state));
                    rig.set_input("X4", true);
                    rig.run(60ms);
                    rig.set_input("X4", false);
                    rig.faults().clear();
                    ASSERT_TRUE(rig.run_until([&] { return ended(back->value().state); }, 5s));
                    EXPECT_EQ(back->value().state, CommandState::error) << describe(back->value());
                    EXPECT_GT(std::abs(rig.load_mm()), 0.1);
                  });
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
