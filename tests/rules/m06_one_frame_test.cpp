// M6, M8: block and trigger in one frame, where the drive was seen to start so (drive.start_in_one_frame).
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using simulation::FaultKind;

constexpr std::uint16_t block = 0x0020, terminal_move_mode = 0x0026, trigger = 0x0027, stop = 0x0028;

RigOptions one_frame() {
  return {.adjust = [](AxisSettings& axis) { axis.model_settings["start_in_one_frame"] = true; }};
}

bool is_start(const WireEntry& one) {
  return one.function() == 0x10 && one.address() == block && one.block().size() == 8;
}

int starts_on_the_wire(const Rig& rig) {
  return static_cast<int>(std::ranges::count_if(rig.line->wire(), is_start));
}

/// Until the drive is asked for its canary, for a start that has no other proof.
CommandPtr move_with_canary(Rig& rig, double target) {
  rig.line->forget_wire();
  auto move = rig.submit(MoveAbsoluteRequest{.position = target});
  EXPECT_TRUE(rig.run_until(
      [&] { return !rig.line->wire().empty() && rig.line->wire().back().address() == block; }, 1s));
  EXPECT_EQ(starts_on_the_wire(rig), 0);
  return move;
}

TEST(M06, BlockAndTriggerGoInOneFrameWhereTheConfigurationSaysSo) {
  both_directions(one_frame(), [](const RigOptions& base) {
    for (const std::uint16_t mode : {0, 1}) {
      auto options = base;
      options.before_start = [mode](simulation::SimulatedRtuNode& drive, VirtualWorld&) {
        drive.poke(terminal_move_mode, mode);
      };
      Rig rig(options);
      rig.ready();
      rig.line->forget_wire();
      for (const double target : {10.0, 3.0, 7.5, 0.0}) {
        const auto moved = rig.complete(MoveAbsoluteRequest{.position = target});
        EXPECT_EQ(moved.state, CommandState::done) << describe(moved);
        EXPECT_NEAR(rig.load_mm(), target, 1e-9);
      }
      EXPECT_EQ(starts_on_the_wire(rig), 4);
      EXPECT_EQ(rig.writes_of(trigger), 0);
      for (const auto& one : rig.line->wire())
        if (is_start(one)) EXPECT_EQ(one.block().at(6), mode) << "as it stood there";
      EXPECT_EQ(rig.drive->peek(terminal_move_mode), mode);
    }
  });
}

TEST(M08, ALostFrameOfAStartInOneFrameIsResolvedByReadingBack) {
  both_directions(one_frame(), [](const RigOptions& options) {
    struct Case {
      FaultKind kind;
      bool executed;
    };
    for (const auto& [kind, executed] : {Case{FaultKind::drop_request, false},
                                         {FaultKind::corrupt_request, false},
                                         {FaultKind::drop_reply, true},
                                         {FaultKind::corrupt_reply, true},
                                         {FaultKind::delay_reply, true}}) {
      SCOPED_TRACE(to_string(kind));
      Rig rig(options);
      rig.ready();
      rig.fault({.kind = kind, .function = 0x10, .register_address = trigger, .delay = 60ms});
      rig.line->forget_wire();
      const auto moved = rig.complete(MoveAbsoluteRequest{.position = 30});
      EXPECT_EQ(starts_on_the_wire(rig), 1) << "never sent again";
      EXPECT_EQ(rig.drive->starts(), executed ? 1 : 0);
      EXPECT_EQ(moved.state, executed ? CommandState::done : CommandState::error) << describe(moved);
      if (!executed) {
        EXPECT_EQ(moved.cause->outcome, Outcome::not_executed) << describe(moved);
        rig.run(1s);
        EXPECT_GE(rig.writes_of(stop), 1) << "with a stop (M10)";
        EXPECT_EQ(rig.load_mm(), 0);
      }
      const auto next = rig.complete(MoveAbsoluteRequest{.position = 5});
      EXPECT_EQ(next.state, CommandState::done) << describe(next);
      EXPECT_NEAR(rig.load_mm(), 5, 1e-9);
      EXPECT_EQ(rig.state()->reboots, 0);
    }
  });
}

/// A drive that does not start so is told from one that does, and nothing is taken for a restart.
TEST(M06, ADriveThatTakesNoStartInOneFrameDoesNotMove) {
  for (const bool refused : {false, true})
    for (const bool partial : {false, true}) {
      auto options = one_frame();
      options.switches = {
          {"one_frame_start", false}, {"one_frame_start_refused", refused}, {"partial_block_write", partial}};
      Rig rig(options);
      rig.ready();
      rig.line->forget_wire();
      const auto moved = rig.complete(MoveAbsoluteRequest{.position = 30});
      EXPECT_EQ(moved.state, CommandState::error);
      ASSERT_TRUE(moved.cause);
      EXPECT_EQ(moved.cause->reason, refused ? Reason::refused : Reason::did_not_start) << describe(moved);
      EXPECT_EQ(starts_on_the_wire(rig), 1);
      rig.run(3s);
      EXPECT_EQ(rig.drive->starts(), 0);
      EXPECT_EQ(rig.load_mm(), 0);
      EXPECT_EQ(rig.state()->reboots, 0);
      EXPECT_EQ(rig.state()->link, LinkState::online);
    }
}

/// Not said either: with one register refused, the trigger behind it may be taken all the same.
TEST(M08, ARefusedStartInOneFrameIsReadBackToo) {
  both_directions(one_frame(), [](const RigOptions& base) {
    for (const bool skipped : {false, true}) {
      SCOPED_TRACE(skipped);
      auto options = base;
      options.switches = {{"bad_register_skipped", skipped}};
      // What stands there cannot be written back.
      options.before_start = [](simulation::SimulatedRtuNode& drive, VirtualWorld&) {
        drive.poke(terminal_move_mode, 2);
      };
      Rig rig(options);
      rig.ready();
      rig.line->forget_wire();
      const auto moved = rig.complete(MoveRelativeRequest{.distance = 30});
      EXPECT_EQ(moved.state, skipped ? CommandState::done : CommandState::error) << describe(moved);
      if (!skipped) {
        ASSERT_TRUE(moved.cause);
        EXPECT_EQ(moved.cause->reason, Reason::refused) << describe(moved);
        EXPECT_EQ(moved.cause->outcome, Outcome::not_executed) << describe(moved);
      }
      rig.run(1s);
      EXPECT_EQ(starts_on_the_wire(rig), 1) << "never sent again";
      EXPECT_EQ(rig.drive->starts(), skipped ? 1 : 0);
      EXPECT_NEAR(rig.load_mm(), skipped ? 30 : 0, 1e-9);
      EXPECT_EQ(rig.state()->reboots, 0);
    }
  });
}

/// The gate forbids the frame as it forbids a trigger: with the stop, and when the canary has grown too old.
TEST(M14, AStopComesBeforeAStartInOneFrame) {
  Rig rig(one_frame());
  rig.ready();
  EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 10}).state, CommandState::done);
  rig.run(85ms);
  const auto move = move_with_canary(rig, 20);
  EXPECT_EQ(rig.complete(StopRequest{}).state, CommandState::done);
  EXPECT_TRUE(move->has_ended());
  rig.run(1s);
  EXPECT_EQ(starts_on_the_wire(rig), 0);
  EXPECT_EQ(rig.load_mm(), 10);
}

/// The shaft is looked at between the block and the trigger there.
TEST(M06, WhatATerminalMayMoveIsLoadedFirst) {
  auto options = one_frame();
  options.switches = {{"enabled_at_power_up", false}};
  options.adjust = [adjust = options.adjust](AxisSettings& axis) {
    adjust(axis);
    axis.inputs.push_back({.terminal = "X4", .function = "jog_positive"});
  };
  Rig rig(options);
  rig.ready();
  rig.line->forget_wire();
  EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 10}).state, CommandState::done);
  EXPECT_EQ(starts_on_the_wire(rig), 0);
  EXPECT_EQ(rig.writes_of(trigger), 1);
}

/// A velocity has no way to look at, but 0x0026 is the terminal's all the same.
TEST(M06, AVelocityOfWhatATerminalMayMoveIsLoadedFirst) {
  auto options = one_frame();
  options.limits = false;
  options.switches = {{"enabled_at_power_up", false}};
  options.adjust = [adjust = options.adjust](AxisSettings& axis) {
    adjust(axis);
    axis.inputs.push_back({.terminal = "X4", .function = "jog_positive"});
  };
  Rig rig(options);
  rig.ready();
  rig.write_behind(terminal_move_mode, 1);
  rig.line->forget_wire();
  const auto run = rig.submit(MoveVelocityRequest{.velocity = 10});
  rig.run(300ms);
  EXPECT_EQ(run->value().state, CommandState::active);
  EXPECT_EQ(starts_on_the_wire(rig), 0);
  EXPECT_EQ(rig.writes_of(trigger), 1);
  EXPECT_EQ(rig.drive->peek(terminal_move_mode), 1);
  EXPECT_EQ(rig.complete(StopRequest{}).state, CommandState::done);
}

}  // namespace
}  // namespace axisd::test
