// M19: a relative move goes as far as was asked, wherever the shaft was moved before.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;

RigOptions closed_loop(std::string model = "ess42-r") {
  return {.model = std::move(model), .adjust = [](AxisSettings& axis) {
            axis.homing->method = HomingMethod::negative_limit;
            axis.model_settings["released_position"] = std::string("counted");
          }};
}

/// Somebody turns the shaft; mm in axis direction.
void turn(Rig& rig, const RigOptions& options, double mm) {
  rig.drive->advance(rig.world.now());
  ASSERT_TRUE(rig.drive->push_shaft(std::llround(mm * 100) * (options.invert ? -1 : 1)));
}

void expect_moves(Rig& rig, const Action& action, double mm) {
  const auto before = rig.load_mm();
  const auto moved = rig.complete(action);
  EXPECT_EQ(moved.state, CommandState::done) << describe(moved);
  EXPECT_NEAR(rig.load_mm() - before, mm, 0.12);
  EXPECT_NEAR(*moved.granted.distance, mm, 0.12);
}

TEST(M19, AShaftTurnedWhileReleasedIsTheNewBase) {
  for (const auto* model : {"ess42-r", "ssd2608pr"})
    both_directions(closed_loop(model), [](const RigOptions& options) {
      Rig rig(options);
      rig.enable();
      rig.complete(DisableRequest{});
      EXPECT_EQ(rig.complete(SetPositionRequest{.position = 200}).state, CommandState::done);
      turn(rig, options, 150);
      rig.enable();
      expect_moves(rig, MoveRelativeRequest{.distance = 1}, 1);
      expect_moves(rig, MoveRelativeRequest{.distance = -1}, -1);
    });
}

TEST(M19, AShaftTurnedAfterAMoveIsTheNewBase) {
  both_directions(closed_loop(), [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    expect_moves(rig, MoveAbsoluteRequest{.position = 150}, 150);
    rig.complete(DisableRequest{});
    turn(rig, options, -100);
    rig.enable();
    expect_moves(rig, MoveRelativeRequest{.distance = 1}, 1);
  });
}

/// Released and held again between two readings of an axis that is read once per second.
TEST(M19, AReleaseThatNobodySawIsNotRelyedUpon) {
  auto base = closed_loop();
  base.adjust = [adjust = base.adjust](AxisSettings& axis) {
    adjust(axis);
    axis.inputs.push_back({.terminal = "X3", .function = "motor_free"});
    axis.poll_idle = 1s;
  };
  both_directions(base, [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    expect_moves(rig, MoveAbsoluteRequest{.position = 150}, 150);
    rig.run(100ms);
    rig.set_input("X3", true);
    rig.run(60ms);
    turn(rig, options, 40);
    rig.run(20ms);
    rig.set_input("X3", false);
    rig.run(20ms);
    if (!rig.state()->enabled) return;  // the release was seen
    expect_moves(rig, MoveRelativeRequest{.distance = 1}, 1);
  });
}

TEST(M19, AJogWithoutAKnownPositionCountsFromWhereTheShaftIs) {
  both_directions(closed_loop(), [](const RigOptions& options) {
    Rig rig(options);
    rig.enable();
    expect_moves(rig, MoveRelativeRequest{.distance = 5}, 5);
    rig.complete(DisableRequest{});
    turn(rig, options, -280);
    rig.enable();
    const auto before = rig.load_mm();
    const auto jog = rig.submit(JogRequest{.velocity = 10, .hold = 2s});
    rig.run_until([&] { return jog->has_ended(); }, 10s);
    rig.run(1s);
    EXPECT_NEAR(rig.load_mm() - before, 10, 0.12);
  });
}

/// Between the plan and the start, while nobody looked: towards the limit would be the other way then.
TEST(M19, AVelocityGoesNoOtherWayThanWasAskedFor) {
  auto base = closed_loop();
  base.persistence = base.journal = true;
  base.adjust = [adjust = base.adjust](AxisSettings& axis) {
    adjust(axis);
    axis.inputs.push_back({.terminal = "X3", .function = "motor_free"});
    axis.poll_moving = 200ms;
  };
  int unseen = 0;
  both_directions(base, [&](const RigOptions& options) {
    for (Duration phase = 0ms; phase < 200ms; phase += 20ms) {
      Rig rig(options);
      rig.ready();
      expect_moves(rig, MoveAbsoluteRequest{.position = 150}, 150);
      rig.run(500ms);  // nobody awaits its end any more
      rig.journal.slow = true;
      const auto jog = rig.submit(JogRequest{.velocity = 10, .hold = 2s}, {.client = "a", .request_id = "r"});
      rig.run(100ms + phase);
      rig.set_input("X3", true);
      rig.run(20ms);
      rig.drive->advance(rig.world.now());
      const bool turned = rig.drive->push_shaft(options.invert ? -30000 : 30000);
      rig.set_input("X3", false);
      rig.run(30ms);
      const bool seen = jog->has_ended();
      const auto before = rig.load_mm();
      rig.journal.release();
      rig.run(3s);
      if (!turned || seen) continue;
      ++unseen;
      EXPECT_NEAR(rig.load_mm(), before, 0.12) << describe(jog->value());
      EXPECT_EQ(jog->value().state, CommandState::error) << describe(jog->value());
      EXPECT_EQ(jog->value().cause->reason, Reason::soft_limit) << describe(jog->value());
    }
  });
  EXPECT_GT(unseen, 0);
}

/// The drive reaches home, and zeroes its counter, while the halt before the jog is under way.
TEST(M19, AJogThatFollowsHomingCountsAfterTheCounterWasZeroed) {
  both_directions({}, [](const RigOptions& options) {
    const auto homed = [](Rig& rig) { return (rig.drive->peek(0x0007) & 2U) != 0; };
    TimePoint reached{};
    {
      Rig rig(options);
      rig.ready();
      rig.submit(HomeRequest{});
      ASSERT_TRUE(rig.run_until([&] { return homed(rig); }, 60s));
      reached = rig.world.now();
    }
    for (auto before = 30ms; before >= 0ms; before -= 2ms) {
      Rig rig(options);
      rig.ready();
      rig.submit(HomeRequest{});
      rig.run(reached - before - rig.world.now());
      const auto at = rig.load_mm();
      const auto jog = rig.try_submit(JogRequest{.velocity = 10, .hold = 2s});
      if (!jog) continue;
      rig.run_until([&] { return (*jog)->has_ended(); }, 10s);
      rig.run(1s);
      // 1 mm: what the halt of the homing takes.
      EXPECT_NEAR(rig.load_mm(), at + 10, 1) << before.count() << " ms before home";
    }
  });
}

TEST(M19, ABufferedRelativeMoveStartsWhereTheOneBeforeEnded) {
  both_directions(closed_loop(), [](const RigOptions& options) {
    Rig rig(options);
    rig.ready();
    const auto before = rig.load_mm();
    rig.submit(MoveAbsoluteRequest{.position = 20});
    rig.submit(MoveRelativeRequest{.distance = 5}, {.buffer_mode = BufferMode::buffered});
    const auto last = rig.submit(MoveRelativeRequest{.distance = -1}, {.buffer_mode = BufferMode::buffered});
    rig.run_until([&] { return last->has_ended(); }, 60s);
    EXPECT_EQ(last->value().state, CommandState::done) << describe(last->value());
    EXPECT_NEAR(rig.load_mm() - before, 24, 0.12);
  });
}

}  // namespace
}  // namespace axisd::test
