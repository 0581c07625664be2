// Homing on CANopen: a bit that is left from an earlier homing, and what happens while homing is being left.
#include <gtest/gtest.h>

#include "tests/rules/m23_can_rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

const std::vector<std::vector<const char*>> bits = {{"homed_only_bit8"},
                                                    {"homed_only_bit12"},
                                                    {"homed_stays_during_homing"},
                                                    {"homed_only_bit12", "homed_stays_during_homing"},
                                                    {"homed_only_bit8", "homed_stays_during_homing"},
                                                    {"offset_without_move"}};

void with_stop_input(AxisSettings& axis) { axis.inputs.push_back({.terminal = "X3", .function = "stop"}); }

/// Connects and enables; `polled`: a drive that takes no TPDO.
void enable(CanRig& rig, bool polled) {
  if (polled)
    rig.nodes().add_fault(
        {.kind = simulation::FaultKind::abort, .count = -1, .object = 0x1A00, .code = 0x06010002});
  rig.reconnect();
  rig.done(EnableRequest{});
}

TEST(M21, AHomingThatTheDriveIgnoresDoesNotReachHome) {
  for_each_reading({.adjust = with_stop_input}, bits, [](const CanRigOptions& options) {
    for (const bool restart : {false, true}) {
      CanRig rig(options);
      rig.done(EnableRequest{});
      rig.done(HomeRequest{});
      rig.done(MoveAbsoluteRequest{.position = 7});
      if (restart) {
        rig.stop_daemon();
        rig.start_daemon();
        rig.done(EnableRequest{});
      }
      rig.touch([](auto& node) { node.set_input("X3", true); });
      rig.run(300ms);
      const auto homed = rig.complete(HomeRequest{});
      EXPECT_NE(homed.state, CommandState::done) << "restarted " << restart;
      EXPECT_NE(rig.state()->trust, PositionTrust::homed);
      rig.touch([](auto& node) { node.set_input("X3", false); });
      rig.run(1s);
      rig.done(ResetRequest{});
      rig.done(EnableRequest{});
      rig.done(HomeRequest{});
      EXPECT_EQ(rig.state()->trust, PositionTrust::homed);
    }
  });
}

TEST(M21, AHomingThatAStopTerminalEndsOnItsWayIsNotHome) {
  for_each_reading({.adjust = with_stop_input}, bits, [](const CanRigOptions& options) {
    CanRig rig(options);
    rig.done(EnableRequest{});
    rig.done(HomeRequest{});
    rig.done(MoveAbsoluteRequest{.position = 40});
    const auto command = rig.submit(HomeRequest{});
    rig.run(800ms);
    ASSERT_TRUE(rig.drive->shaft_moving());
    rig.touch([](auto& node) { node.set_input("X3", true); });
    rig.run(5s);
    EXPECT_TRUE(command->has_ended());
    EXPECT_NE(command->value().state, CommandState::done);
    EXPECT_NE(rig.state()->trust, PositionTrust::homed);
  });
}

/// A pulse between two samples: only the place tells.
TEST(M21, AHomingThatAnUnseenStopEndedIsNotHome) {
  for_each_reading(
      {.connect = false,
       .adjust =
           [](AxisSettings& axis) {
             with_stop_input(axis);
             axis.poll_moving = 400ms;
           }},
      bits, [](const CanRigOptions& options) {
        CanRig rig(options);
        rig.nodes().add_fault(
            {.kind = simulation::FaultKind::abort, .count = -1, .object = 0x1A00, .code = 0x06010002});
        rig.reconnect();
        rig.done(EnableRequest{});
        rig.done(HomeRequest{});
        EXPECT_EQ(rig.state()->trust, PositionTrust::homed);
        rig.done(MoveAbsoluteRequest{.position = 40});
        const auto command = rig.submit(HomeRequest{});
        const auto before = rig.shaft();
        ASSERT_TRUE(rig.run_until([&] { return rig.shaft() < before - 2000; }, 10s));
        rig.touch([](auto& node) { node.set_input("X3", true); });
        rig.run(15ms);
        rig.touch([](auto& node) { node.set_input("X3", false); });
        rig.run(5s);
        EXPECT_LT(rig.shaft(), before);
        EXPECT_TRUE(command->has_ended());
        EXPECT_NE(command->value().state, CommandState::done);
        EXPECT_NE(rig.state()->trust, PositionTrust::homed);
        rig.done(ResetRequest{});
        rig.done(HomeRequest{});
        EXPECT_EQ(rig.state()->trust, PositionTrust::homed);
      });
}

TEST(M21, AMotionThatFollowsHomingAtOnceIsNotHalted) {
  for (const bool polled : {false, true}) {
    CanRig rig({.limits = false, .connect = false});
    enable(rig, polled);
    for (int time = 0; time < 4; ++time) {
      rig.done(HomeRequest{});
      const auto command = rig.submit(MoveVelocityRequest{.velocity = 20});
      rig.run(std::chrono::milliseconds(500 + time));
      EXPECT_TRUE(rig.drive->shaft_moving()) << describe(command->value());
      rig.done(StopRequest{.kind = StopKind::stop});
      EXPECT_FALSE(rig.drive->shaft_moving());
    }
  }
}

/// Lets it home for `duration`. False: it does not turn.
bool homes(CanRig& rig, bool polled, Duration duration) {
  enable(rig, polled);
  (void)rig.submit(HomeRequest{});
  rig.run(duration);
  return rig.drive->shaft_moving();
}

TEST(M12, TheModeStaysWhileAStoppedHomingRunsOut) {
  for (const bool polled : {false, true}) {
    CanRig rig({.connect = false, .adjust = [](AxisSettings& axis) {
                  axis.homing->velocity = 50;
                  axis.homing->acceleration_time = 1000ms;
                }});
    ASSERT_TRUE(homes(rig, polled, 700ms));
    (void)rig.submit(StopRequest{.kind = StopKind::stop});
    bool moved = true;
    for (int i = 0; i < 200 && moved; ++i) {
      rig.run(5ms);
      moved = rig.drive->shaft_moving();
      if (moved) EXPECT_EQ(rig.drive->peek(0x606100), 6U) << "in its ramp";
    }
    rig.run(1s);
    EXPECT_EQ(rig.drive->peek(0x606100), 1U);
  }
}

TEST(M05, AnAlarmThatEndsAHomingIsToldThoughItIsGone) {
  for (const bool polled : {false, true}) {
    CanRig rig({.connect = false});
    ASSERT_TRUE(homes(rig, polled, 500ms));
    rig.touch([](auto& node) { node.raise_alarm(2); });
    rig.run(500us);
    rig.touch([](auto& node) { node.raise_alarm(0); });
    rig.run(1s);
    EXPECT_EQ(rig.state()->state, AxisState::error_stop);
    ASSERT_TRUE(rig.state()->fault);
    EXPECT_EQ(rig.state()->fault->where.native_code, 2U) << to_string(*rig.state()->fault);
  }
}

}  // namespace
}  // namespace axisd::test
