// M20: open loop. What a terminal started may end at a limit, or by a quick stop, without a ramp, and between
// two readings.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

RigOptions jogged(Duration poll_idle) {
  return {.switches = {{"enabled_at_power_up", false}, {"abrupt_stop_slips", true}},
          .adjust = [poll_idle](AxisSettings& axis) {
            axis.inputs.push_back({.terminal = "X3", .function = "quick_stop"});
            axis.inputs.push_back({.terminal = "X4", .function = "jog_positive"});
            axis.poll_idle = poll_idle;
          }};
}

/// Too short to be seen in motion where the axis is read rarely.
constexpr auto jogged_for = 100ms;

/// Its jog is ended by `terminals`, which stay as they are.
void end_jog(Rig& rig, std::initializer_list<const char*> terminals) {
  rig.set_input("X4", true);
  rig.run(jogged_for);
  for (const auto* terminal : terminals) rig.set_input(terminal, true);
  rig.run(5ms);
  rig.set_input("X4", false);
  rig.run(3s);
}

TEST(M20TerminalMotion, ThatEndsAtALimitLosesThePosition) {
  for (const auto poll_idle : {20ms, 2000ms})
    both_directions(jogged(poll_idle), [](const RigOptions& options) {
      Rig rig(options);
      rig.ready();
      end_jog(rig, {"X1"});
      ASSERT_FALSE(rig.drive->shaft_moving());
      ASSERT_GT(std::abs(rig.load_mm()), 0.01);
      EXPECT_GT(std::abs(rig.state()->position - rig.load_mm()), 0.05) << "it slipped";
      EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
    });
}

TEST(M20TerminalMotion, ThatAQuickStopEndsLosesThePosition) {
  for (const auto poll_idle : {20ms, 2000ms})
    both_directions(jogged(poll_idle), [](const RigOptions& options) {
      Rig rig(options);
      rig.ready();
      end_jog(rig, {"X3"});
      ASSERT_FALSE(rig.drive->shaft_moving());
      EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
    });
}

TEST(M20TerminalMotion, ThatEndsWithItsTerminalKeepsIt) {
  for (const auto poll_idle : {20ms, 2000ms})
    both_directions(jogged(poll_idle), [](const RigOptions& options) {
      Rig rig(options);
      rig.ready();
      end_jog(rig, {});
      ASSERT_GT(std::abs(rig.load_mm()), 0.01);
      EXPECT_NEAR(rig.state()->position, rig.load_mm(), 0.011);
      EXPECT_EQ(rig.state()->trust, PositionTrust::set);
    });
}

/// What comes next ends the mode before anybody has read it, or reads it for itself.
void home_by_terminal(Rig& rig, double home_mm, Duration after_a_reading, const Action& next) {
  rig.run(after_a_reading);
  rig.set_input("X4", true);
  rig.run(50ms);
  rig.set_input("X4", false);
  rig.run(3s);
  ASSERT_FALSE(rig.drive->shaft_moving());
  ASSERT_NEAR(rig.load_mm(), home_mm, 0.2) << "it came home";
  const auto starts = rig.drive->starts();
  (void)rig.try_submit(next);
  rig.run(6s);
  EXPECT_EQ(rig.drive->starts(), starts) << "to where its position is not";
  EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
}

/// Of a drive that has homed before, so that the homed bit tells nothing.
void home_again(const RigOptions& options, Duration after_a_reading, const Action& next) {
  Rig rig(options);
  rig.ready();
  EXPECT_EQ(rig.complete(HomeRequest{}).state, CommandState::done);
  EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 1}).state, CommandState::done);
  rig.complete(DisableRequest{});
  rig.drive->advance(rig.world.now());
  ASSERT_TRUE(rig.drive->push_shaft(options.invert ? -100 : 100)) << "which an open loop does not count";
  rig.enable();
  EXPECT_EQ(rig.complete(SetPositionRequest{.position = 8}).state, CommandState::done);
  home_by_terminal(rig, -50, after_a_reading, next);
}

/// Of one that is not homed, so that the counter may tell nothing: it was 0 before.
void home_from_zero(RigOptions options, Duration after_a_reading, const Action& next) {
  options.adjust_drive = [&](simulation::SimulatedNodeSettings& drive) {
    drive.mechanics.home_switch_from = options.invert ? 100 : -300;
    drive.mechanics.home_switch_to = options.invert ? 300 : -100;
  };
  Rig rig(options);
  rig.ready();
  home_by_terminal(rig, -1, after_a_reading, next);
}

TEST(M20TerminalMotion, HomingBetweenTwoReadingsLosesThePosition) {
  for (const auto poll_idle : {20ms, 6000ms})
    for (const auto after : {0ms, 1000ms, 2000ms, 3000ms, 4000ms, 5000ms})
      both_directions(jogged(poll_idle), [after](RigOptions options) {
        options.adjust = [adjust = options.adjust](AxisSettings& axis) {
          adjust(axis);
          axis.inputs.back().function = "homing_start";
        };
        for (const auto& next :
             {Action(StopRequest{.kind = StopKind::halt}), Action(MoveAbsoluteRequest{.position = 30})}) {
          home_again(options, after, next);
          home_from_zero(options, after, next);
        }
      });
}

}  // namespace
}  // namespace axisd::test
