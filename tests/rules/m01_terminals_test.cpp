// What a drive's own terminals end or begin: M1, M4, M5, on both buses.
#include <gtest/gtest.h>

#include "tests/rules/m23_can_rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

void add_input(AxisSettings& axis, std::string terminal, std::string function) {
  axis.inputs.push_back({.terminal = std::move(terminal), .function = std::move(function)});
}

/// What another master on the bus writes, off the wire that axisd sees.
void write_behind(CanRig& rig, std::uint16_t index, std::uint8_t size, std::int32_t value) {
  can::Frame frame{.id = 0x600U + CanRig::node_id, .size = 8};
  frame.data[0] = static_cast<std::uint8_t>(0x23U | (4U - size) << 2U);
  frame.data[1] = static_cast<std::uint8_t>(index);
  frame.data[2] = static_cast<std::uint8_t>(index >> 8U);
  for (unsigned i = 0; i < size; ++i)
    frame.data.at(4 + i) = static_cast<std::uint8_t>(static_cast<std::uint32_t>(value) >> 8U * i);
  rig.touch([&](auto& node) { node.on_frame(frame); });
  rig.run(5ms);
}

/// 60FFh is a level: what ended the motion opens again, and the drive that follows it must have nothing left
/// to follow.
TEST(M01, AVelocityMotionThatATerminalEndedStaysEnded) {
  for (const bool resumes : {true, false}) {
    for (const std::string function : {"stop", "quick_stop", "motor_free", "negative_limit"}) {
      for (const bool free_stop_releases : {false, true}) {
        const bool limit = function == "negative_limit";
        if (free_stop_releases && !limit) continue;
        SCOPED_TRACE(function + (free_stop_releases ? ", which releases" : ""));
        CanRig rig({.switches = {{"velocity_resumes_after_terminal", resumes},
                                 {"release_keeps_state", true},
                                 {"free_stop_releases", free_stop_releases}},
                    .limits = false,
                    .switches_near = false,
                    .adjust = [&](AxisSettings& axis) {
                      if (!limit) add_input(axis, "X3", function);
                      if (free_stop_releases) axis.model_settings["overtravel_stop"] = std::string("free");
                    }});
        rig.ready();
        const auto command = rig.submit(MoveVelocityRequest{.velocity = -50});
        rig.run(600ms);
        ASSERT_TRUE(rig.state()->moving) << describe(command->value());
        const auto* const terminal = limit ? "X2" : "X3";
        rig.touch([&](auto& node) { node.set_input(terminal, true); });
        ASSERT_TRUE(rig.run_until([&] { return command->has_ended(); }, 3s));
        EXPECT_EQ(command->value().state, CommandState::aborted) << describe(command->value());
        rig.run(1s);
        EXPECT_FALSE(rig.drive->shaft_moving());
        EXPECT_EQ(rig.drive->peek(0x60FF00), 0U);
        const auto at = rig.shaft();
        const auto starts = rig.drive->starts();
        rig.touch([&](auto& node) { node.set_input(terminal, false); });
        rig.run(2s);
        EXPECT_EQ(rig.shaft(), at);
        EXPECT_EQ(rig.drive->starts(), starts);
        if (rig.state()->enabled) EXPECT_EQ(rig.state()->state, AxisState::standstill);
      }
    }
  }
}

TEST(M01, AMotionThatATerminalEndedGetsAStopOnRs485Too) {
  both_directions({.limits = false}, [](const RigOptions& base) {
    for (const std::string function : {"stop", "quick_stop"}) {
      SCOPED_TRACE(function);
      auto options = base;
      options.adjust = [&](AxisSettings& axis) { add_input(axis, "X3", function); };
      Rig rig(options);
      rig.ready();
      const auto command = rig.submit(MoveVelocityRequest{.velocity = 20});
      rig.run(600ms);
      ASSERT_TRUE(rig.state()->moving) << describe(command->value());
      rig.line->forget_wire();
      rig.set_input("X3", true);
      ASSERT_TRUE(rig.run_until([&] { return command->has_ended(); }, 3s));
      EXPECT_EQ(command->value().state, CommandState::aborted) << describe(command->value());
      rig.run(200ms);
      EXPECT_EQ(rig.writes_of(0x0028), 1);
      EXPECT_EQ(rig.state()->state, AxisState::standstill);
      rig.set_input("X3", false);
      const auto next = rig.complete(MoveRelativeRequest{.distance = 1});
      EXPECT_EQ(next.state, CommandState::done) << describe(next);
    }
  });
}

/// That a terminal could start a motion says nothing while it is open.
TEST(M01, WhatRunsByItselfIsNotTakenForATerminals) {
  both_directions({.switches = {{"enabled_at_power_up", false}},
                   .adjust = [](AxisSettings& axis) { add_input(axis, "X4", "jog_positive"); }},
                  [](const RigOptions& options) {
                    Rig rig(options);
                    rig.ready();
                    rig.write_behind(0x0023, 60);
                    rig.write_behind(0x0027, 2);
                    EXPECT_TRUE(rig.run_until([&] { return rig.state()->moving; }, 1s));
                    EXPECT_NE(rig.state()->motion_cause, MotionCause::terminal);
                    rig.run(1500ms);
                    EXPECT_FALSE(rig.drive->shaft_moving());
                  });

  CanRig rig({.adjust = [](AxisSettings& axis) { add_input(axis, "X3", "jog_positive"); }});
  rig.ready();
  write_behind(rig, 0x6060, 1, 3);
  write_behind(rig, 0x60FF, 4, 60);
  write_behind(rig, 0x6040, 2, 0x0F);
  ASSERT_TRUE(rig.drive->shaft_moving());
  EXPECT_TRUE(rig.run_until([&] { return rig.state()->moving; }, 1s));
  EXPECT_NE(rig.state()->motion_cause, MotionCause::terminal);
  rig.run(1500ms);
  EXPECT_FALSE(rig.drive->shaft_moving());
}

TEST(M01, AJogOfATerminalRunsForAsLongAsItIsHeld) {
  both_directions({.switches = {{"enabled_at_power_up", false}},
                   .adjust = [](AxisSettings& axis) { add_input(axis, "X4", "jog_positive"); }},
                  [](const RigOptions& options) {
                    Rig rig(options);
                    rig.ready();
                    rig.line->forget_wire();
                    rig.set_input("X4", true);
                    rig.run(2s);
                    EXPECT_TRUE(rig.drive->shaft_moving());
                    EXPECT_EQ(rig.state()->motion_cause, MotionCause::terminal);
                    EXPECT_GT(rig.load_mm(), 1);
                    rig.set_input("X4", false);
                    rig.run(3s);
                    EXPECT_FALSE(rig.drive->shaft_moving());
                    EXPECT_EQ(rig.state()->motion_cause, MotionCause::none);
                    EXPECT_EQ(rig.writes_of(0x0028), 0);
                  });

  CanRig rig({.adjust = [](AxisSettings& axis) { add_input(axis, "X3", "jog_positive"); }});
  rig.ready();
  rig.touch([](auto& node) { node.set_input("X3", true); });
  rig.run(1s);
  EXPECT_TRUE(rig.drive->shaft_moving());
  EXPECT_EQ(rig.state()->motion_cause, MotionCause::terminal);
  rig.touch([](auto& node) { node.set_input("X3", false); });
  rig.run(3s);
  EXPECT_FALSE(rig.drive->shaft_moving());
  EXPECT_EQ(rig.state()->motion_cause, MotionCause::none);
}

/// A pulse shorter than the motion that it starts.
TEST(M01, AHomingThatATerminalStartedIsNotStopped) {
  for (const bool pauses : {false, true}) {
    Rig rig({.switches = {{"enabled_at_power_up", false}, {"homing_pauses", pauses}},
             .adjust = [](AxisSettings& axis) { add_input(axis, "X4", "homing_start"); }});
    rig.ready();
    EXPECT_EQ(rig.complete(HomeRequest{}).state, CommandState::done);
    EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 20}).state, CommandState::done);
    const auto starts = rig.drive->starts();
    rig.set_input("X4", true);
    rig.run(200ms);
    rig.set_input("X4", false);
    EXPECT_TRUE(rig.run_until([&] { return rig.state()->motion_cause == MotionCause::terminal; }, 1s));
    rig.run(15s);
    EXPECT_EQ(rig.drive->starts(), starts + 1);
    EXPECT_NEAR(rig.load_mm(), -50, 0.2) << "it came home";
  }
}

/// Within homing the motor rests between its phases: found like that, it goes on unless it is stopped.
TEST(M04, FoundBetweenTwoPhasesOfHoming) {
  both_directions({.switches = {{"homing_pauses", true}}}, [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    (void)rig.submit(HomeRequest{});
    rig.run(200ms);
    ASSERT_TRUE(rig.drive->shaft_moving());
    rig.stop_daemon();
    for (int i = 0; i < 2000 && rig.drive->shaft_moving(); ++i) rig.idle(5ms);
    ASSERT_EQ(rig.drive->peek(0x0003), 1U) << "between two phases";
    const auto at = rig.load_mm();
    rig.start_daemon(false);
    rig.run(10s);
    EXPECT_NEAR(rig.load_mm(), at, 0.5);
    EXPECT_FALSE(rig.drive->shaft_moving());
    EXPECT_EQ(rig.state()->link, LinkState::online);
    const auto first = std::ranges::find_if(rig.line->wire(), &WireEntry::is_write);
    ASSERT_NE(first, rig.line->wire().end());
    EXPECT_EQ(first->address(), 0x0028);
  });

  CanRig rig({.switches = {{"homing_pauses", true}}});
  rig.ready();
  (void)rig.submit(HomeRequest{});
  rig.run(200ms);
  ASSERT_TRUE(rig.drive->shaft_moving());
  rig.stop_daemon();
  for (int i = 0; i < 2000 && rig.drive->shaft_moving(); ++i) {
    rig.run(5ms);
    rig.nodes().advance();
  }
  ASSERT_FALSE(rig.drive->peek(0x604100) >> 8U & 1U) << "not home yet";
  const auto at = rig.shaft();
  rig.start_daemon();
  rig.run(10s);
  EXPECT_NEAR(static_cast<double>(rig.shaft()), static_cast<double>(at), 50);
  EXPECT_FALSE(rig.drive->shaft_moving());
}

/// A client's stop and the one that is owed look for the standstill at the same time. Neither takes the
/// other's samples for time that has passed.
TEST(M04, FoundHomingAClientsStopIsNotDoneBetweenTwoPhases) {
  for (const auto after : {0ms, 50ms, 100ms, 300ms, 700ms}) {
    SCOPED_TRACE(after.count());
    Rig rig({.switches = {{"homing_pauses", true}, {"stop_ignored_in_homing", true}}});
    rig.ready();
    (void)rig.submit(HomeRequest{});
    rig.run(200ms);
    rig.stop_daemon();
    rig.start_daemon(false);
    ASSERT_TRUE(rig.run_until([&] { return rig.writes_of(0x0028) > 0; }, 2s));
    rig.run(after);
    const auto stop = rig.submit(StopRequest{});
    ASSERT_TRUE(rig.run_until([&] { return stop->has_ended(); }, 60s));
    const auto at = rig.load_mm();
    rig.run(3s);
    if (stop->value().state == CommandState::done) EXPECT_NEAR(rig.load_mm(), at, 0.01);
  }
}

/// The sample that looks whether the counter was zeroed may be the only one that shows an alarm.
TEST(M05, AnAlarmWhileTheCounterIsZeroed) {
  const RigOptions rotary{
      .adjust =
          [](AxisSettings& axis) {
            axis.scale = {
                .pulses_per_revolution = 4000, .travel_numerator = 360, .modulo = 360, .unit = "deg"};
            axis.limits.velocity = 18000;
            axis.homing.reset();
            axis.poll_moving = 20s;  // the long way takes hours
            axis.inputs.clear();
          },
      .adjust_drive = [](simulation::SimulatedNodeSettings& node) { node.mechanics = {}; },
      .limits = false};
  Rig line(rotary);
  line.ready();
  const double nearly = ((1 << 30) - 500) / 4000.0 * 360;
  ASSERT_EQ(line.complete(MoveRelativeRequest{.distance = nearly, .with = {.velocity = 18000}}, 100h).state,
            CommandState::done);
  auto command = line.submit(MoveRelativeRequest{.distance = 360});
  ASSERT_TRUE(line.run_until([&] { return line.writes_of(0x002C) == 1; }, 1s));
  line.drive->raise_alarm(2);
  const auto seen = line.line->wire().size();
  ASSERT_TRUE(line.run_until([&] { return line.line->wire().size() >= seen + 2; }, 1s));
  line.drive->raise_alarm(0);
  line.run(1s);
  EXPECT_EQ(line.state()->state, AxisState::error_stop) << describe(command->value());
  ASSERT_TRUE(line.state()->fault);
  EXPECT_EQ(line.state()->fault->where.native_code, 2U);

  CanRig can({.limits = false, .switches_near = false, .adjust = [](AxisSettings& axis) {
                axis.limits.velocity = 400;
              }});
  can.ready();
  can.done(MoveRelativeRequest{.distance = 9'000});
  can.frames.clear();
  command = can.submit(MoveRelativeRequest{.distance = 9'000});
  ASSERT_TRUE(can.run_until([&] { return !can.writes_of(0x201200).empty(); }, 1s));
  can.touch([](auto& node) { node.raise_alarm(2); });
  can.touch([](auto& node) { node.raise_alarm(0); });
  can.run(1s);
  EXPECT_EQ(can.state()->state, AxisState::error_stop) << describe(command->value());
  ASSERT_TRUE(can.state()->fault);
  EXPECT_EQ(can.state()->fault->reason, Reason::alarm) << to_string(*can.state()->fault);
}

/// An axis that nobody polls yet is looked at by its stop alone.
TEST(M05, AnAlarmThatOnlyTheStopSaw) {
  Rig rig({.adjust = [](AxisSettings& axis) { add_input(axis, "X4", "jog_positive"); }, .connect = false});
  rig.run(3s);
  ASSERT_EQ(rig.state()->link, LinkState::configuring) << "the power stage is on";
  rig.line->forget_wire();
  const auto stop = rig.submit(StopRequest{});
  ASSERT_TRUE(rig.run_until([&] { return rig.writes_of(0x0028) == 1; }, 1s));
  rig.drive->raise_alarm(2);
  ASSERT_TRUE(rig.run_until([&] { return stop->has_ended(); }, 1s));
  rig.drive->raise_alarm(0);
  rig.run(500ms);
  EXPECT_EQ(rig.state()->state, AxisState::error_stop);
  ASSERT_TRUE(rig.state()->fault);
  EXPECT_EQ(rig.state()->fault->where.native_code, 2U);
}

/// The acknowledgement of the zeroing does not say when the counter shows it.
TEST(M19, ACounterThatIsZeroedLateIsNotTakenForAMotion) {
  CanRig rig({.switches = {{"position_clear_late", true}},
              .limits = false,
              .switches_near = false,
              .adjust = [](AxisSettings& axis) { axis.limits.velocity = 400; }});
  rig.ready();
  for (int i = 0; i < 3; ++i) rig.done(MoveRelativeRequest{.distance = 9'000});
  EXPECT_EQ(rig.shaft(), 2'700'000);
  EXPECT_NEAR(rig.state()->position, 27'000, 0.01);
  EXPECT_EQ(rig.state()->trust, PositionTrust::set);
}

/// A counter that stays is never trusted: it may become zero whenever it likes.
TEST(M19, ACounterThatIsNotZeroedCostsTheTrust) {
  CanRig rig({.limits = false, .switches_near = false, .adjust = [](AxisSettings& axis) {
                axis.limits.velocity = 400;
              }});
  rig.ready();
  rig.done(MoveRelativeRequest{.distance = 9'000});
  rig.frames.clear();
  const auto command = rig.submit(MoveRelativeRequest{.distance = 9'000});
  ASSERT_TRUE(rig.run_until([&] { return !rig.writes_of(0x201200).empty(); }, 1s));
  write_behind(rig, 0x6064, 4, 900'000);
  ASSERT_TRUE(rig.run_until([&] { return command->has_ended(); }, 2s));
  EXPECT_EQ(command->value().state, CommandState::error) << describe(command->value());
  EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
  EXPECT_EQ(rig.shaft(), 900'000);
}

}  // namespace
}  // namespace axisd::test
