// While the disk is waited for, the axis is looked after; what changes meanwhile counts (M6, M13, M20).
#include <fmt/format.h>
#include <gmock/gmock.h>

#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

/// An axis whose terminal X4 starts a homing.
RigOptions homed_by_a_terminal() {
  return {
      .switches = {{"enabled_at_power_up", false}},
      .adjust =
          [](AxisSettings& axis) { axis.inputs.push_back({.terminal = "X4", .function = "homing_start"}); },
      .persistence = true,
      .journal = true};
}

TEST(SlowDisk, WhatBeganToMoveMeanwhileIsNotStarted) {
  Rig rig(homed_by_a_terminal());
  rig.ready();
  rig.journal.slow = true;
  const auto move = rig.submit(MoveAbsoluteRequest{.position = 100}, {.client = "a", .request_id = "r"});
  rig.run(50ms);
  rig.set_input("X4", true);
  rig.run(300ms);
  ASSERT_TRUE(rig.state()->moving);
  rig.line->forget_wire();
  rig.journal.release();
  rig.run(100ms);
  EXPECT_EQ(move->value().state, CommandState::error) << describe(move->value());
  EXPECT_EQ(move->value().cause->reason, Reason::moving);
  EXPECT_EQ(rig.triggers(), 0);
}

/// Another master starts a motion at a constant velocity.
TEST(M04, MotionThatNobodyAskedForIsStoppedWhileTheDiskIsWaitedFor) {
  const Action actions[] = {MoveAbsoluteRequest{.position = 100}, SetPositionRequest{.position = 5}};
  for (const auto& action : actions) {
    for (const bool journal : {true, false}) {
      SCOPED_TRACE(fmt::format("{} {}", to_string(kind_of(action)), journal));
      Rig rig({.limits = false, .persistence = true, .journal = true});
      rig.ready();
      // A move waits for its record alone, a position for being saved, too.
      if (!journal && kind_of(action) != CommandKind::set_position) continue;
      (journal ? rig.journal.slow : rig.store.slow) = true;
      const auto command = rig.submit(action, {.client = "a", .request_id = "r"});
      rig.run(100ms);
      rig.line->forget_wire();
      rig.write_behind(0x0023, 60);
      rig.write_behind(0x0027, 2);
      rig.run(1s);
      EXPECT_GE(rig.writes_of(0x0028), 1);
      EXPECT_FALSE(rig.drive->shaft_moving());
      EXPECT_EQ(command->value().state, CommandState::aborted) << describe(command->value());
      EXPECT_EQ(command->value().cause->reason, Reason::moving);
      rig.journal.release();
      rig.store.release();
      rig.run(1s);
      EXPECT_EQ(rig.triggers(), 0);
      EXPECT_EQ(rig.state()->state, AxisState::standstill);
    }
  }
}

TEST(SlowDisk, WhatLostItsPositionMeanwhileIsNotStarted) {
  auto options = homed_by_a_terminal();
  options.adjust = [base = options.adjust](AxisSettings& axis) {
    base(axis);
    axis.start_within = 60s;
  };
  Rig rig(options);
  rig.ready();
  rig.journal.slow = true;
  const auto move = rig.submit(MoveAbsoluteRequest{.position = 100}, {.client = "a", .request_id = "r"});
  rig.run(50ms);
  rig.set_input("X4", true);
  rig.run(100ms);
  rig.set_input("X4", false);
  ASSERT_TRUE(rig.run_until(
      [&] { return !rig.state()->moving && rig.state()->trust == PositionTrust::unknown; }, 60s));
  rig.run(1s);
  rig.line->forget_wire();
  rig.journal.release();
  rig.run(1s);
  EXPECT_EQ(move->value().state, CommandState::error) << describe(move->value());
  EXPECT_EQ(move->value().cause->reason, Reason::not_trusted);
  EXPECT_EQ(rig.triggers(), 0);
}

/// The counter of an endless axis is zeroed, once the saved position is forgotten.
TEST(SlowDisk, AStopAndADisableDoNotWaitForIt) {
  Rig rig({.adjust =
               [](AxisSettings& axis) {
                 axis.scale = {
                     .pulses_per_revolution = 4000, .travel_numerator = 360, .modulo = 360, .unit = "deg"};
                 axis.limits = {.velocity = 18000};
                 axis.homing.reset();
                 axis.poll_moving = 20s;  // the long way takes hours
                 axis.inputs.clear();
               },
           .adjust_drive = [](simulation::SimulatedNodeSettings& node) { node.mechanics = {}; },
           .limits = false,
           .persistence = true});
  rig.ready();
  const double nearly = ((1 << 30) - 500) / 4000.0 * 360;
  ASSERT_EQ(rig.complete(MoveRelativeRequest{.distance = nearly, .with = {.velocity = 18000}}, 100h).state,
            CommandState::done);
  rig.store.slow = true;
  const auto move = rig.submit(MoveRelativeRequest{.distance = 360});
  rig.run(100ms);
  const auto stop = rig.submit(StopRequest{});
  ASSERT_TRUE(rig.run_until([&] { return stop->has_ended(); }, 60s));
  EXPECT_EQ(stop->value().state, CommandState::done) << describe(stop->value());
  EXPECT_EQ(move->value().state, CommandState::aborted);
  const auto disable = rig.submit(DisableRequest{});
  ASSERT_TRUE(rig.run_until([&] { return disable->has_ended(); }, 60s));
  EXPECT_EQ(disable->value().state, CommandState::done) << describe(disable->value());
  EXPECT_FALSE(rig.state()->enabled);
  rig.store.release();
  rig.run(1s);
  EXPECT_EQ(rig.writes_of(0x002C), 0) << "what was stopped goes on";
}

TEST(SlowDisk, APositionThatWasNotSetIsNotFoundByARestart) {
  Rig rig({.persistence = true});
  rig.ready();
  rig.store.slow = true;
  const auto set = rig.submit(SetPositionRequest{.position = 250});
  rig.run(300ms);
  rig.submit(StopRequest{});
  rig.run(1s);
  EXPECT_EQ(set->value().state, CommandState::aborted) << describe(set->value());
  rig.store.release();
  rig.run(1s);
  EXPECT_EQ(rig.state()->position, 0);
  rig.stop_daemon();
  rig.start_daemon();
  EXPECT_EQ(rig.state()->position, 0);
}

/// The terminal's homing begins where the counter is 8 mm, or 0, where it also ends.
TEST(SlowDisk, APositionIsNotSetForAnAxisThatATerminalHomesMeanwhile) {
  for (const double from : {8.0, 0.0}) {
    Rig rig(homed_by_a_terminal());
    rig.complete(EnableRequest{});
    if (from != 0) {
      ASSERT_EQ(rig.complete(MoveRelativeRequest{.distance = from}).state, CommandState::done);
    }
    ASSERT_EQ(rig.state()->trust, PositionTrust::unknown);
    rig.store.slow = true;
    const auto set = rig.submit(SetPositionRequest{.position = 250});
    rig.run(300ms);
    rig.set_input("X4", true);
    rig.run(100ms);
    rig.set_input("X4", false);
    ASSERT_TRUE(rig.run_until([&] { return !rig.state()->moving; }, 60s));
    rig.run(1s);
    rig.store.release();
    rig.run(1s);
    EXPECT_EQ(set->value().state, CommandState::error) << describe(set->value());
    EXPECT_EQ(rig.state()->trust, PositionTrust::unknown);
    EXPECT_FALSE(rig.store.saved.axes["feeder"].offset) << "a restart would find it";
  }
}

/// Nobody saw whether the terminal was used while there was no daemon.
TEST(SlowDisk, NoPositionIsRestoredWhereATerminalMayHaveHomed) {
  for (const bool terminal : {false, true}) {
    auto options = homed_by_a_terminal();
    if (!terminal) options.adjust = {};
    Rig rig(options);
    rig.ready();
    rig.run(500ms);
    rig.stop_daemon();
    rig.start_daemon();
    EXPECT_EQ(rig.state()->trust, terminal ? PositionTrust::unknown : PositionTrust::restored);
  }
}

TEST(SlowDisk, AnEnableOnItsWayIsNeverToldAsNotSent) {
  Rig rig({.journal = true});
  rig.complete(DisableRequest{});
  for (const auto after : {0ms, 2ms, 4ms, 6ms, 8ms, 10ms, 12ms, 15ms}) {
    const auto enable =
        rig.submit(EnableRequest{}, {.client = "a", .request_id = fmt::format("e{}", after.count())});
    rig.run(after);
    rig.submit(StopRequest{});
    rig.run(1s);
    const auto& value = enable->value();
    if (value.state != CommandState::done && rig.state()->enabled)
      EXPECT_NE(value.cause->outcome, Outcome::not_sent) << after.count() << " ms: " << describe(value);
    rig.complete(DisableRequest{});
  }
}

}  // namespace
}  // namespace axisd::test
