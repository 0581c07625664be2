// M31: between the acceptance of a command and its first start frame lies a bound, whatever takes the time.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include "tests/rules/m22_group_rig.hpp"
#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

RigOptions kept() { return {.persistence = true, .journal = true}; }

CommandOptions options(Rig& rig, std::string id) {
  return {.client = "a", .request_id = std::move(id), .arrived = rig.world.now()};
}

void expect_late(const CommandPtr& command, std::string_view waited_for) {
  EXPECT_EQ(command->value().state, CommandState::aborted) << describe(command->value());
  if (!command->value().cause) return;
  EXPECT_EQ(command->value().cause->reason, Reason::expired);
  EXPECT_EQ(command->value().cause->outcome, Outcome::not_sent);
  EXPECT_THAT(command->value().cause->message, HasSubstr(std::string(waited_for)));
}

/// As SIGSTOP and SIGCONT: time passes, and nothing runs meanwhile.
void pause(Rig& rig, Duration duration) { rig.world.clock().advance_to(rig.world.now() + duration); }

TEST(M31, WhatWaitsTooLongForTheDiskEndsAndIsNeverSent) {
  const std::vector<Action> starts = {MoveAbsoluteRequest{.position = 100},
                                      MoveRelativeRequest{.distance = 5}, MoveVelocityRequest{.velocity = 10},
                                      JogRequest{.velocity = 10, .hold = 2s}, HomeRequest{}};
  both_directions(kept(), [&](const RigOptions& base) {
    for (const auto& start : starts) {
      Rig rig(base);
      rig.ready();
      rig.journal.slow = true;
      rig.line->forget_wire();
      const auto command = rig.submit(start, options(rig, "r"));
      rig.run(1900ms);
      EXPECT_FALSE(command->has_ended()) << describe(command->value());
      rig.run(110ms);
      expect_late(command, "for the disk");
      rig.journal.release();
      rig.run(5s);
      EXPECT_EQ(rig.triggers(), 0) << to_string(kind_of(start));
      EXPECT_EQ(rig.state()->state, AxisState::standstill);
    }
  });
}

TEST(M31, PowerIsNotGivenLate) {
  Rig rig(kept());
  rig.complete(DisableRequest{});
  rig.journal.slow = true;
  const auto enable = rig.submit(EnableRequest{}, options(rig, "e"));
  rig.run(2100ms);
  expect_late(enable, "for the disk");
  rig.journal.release();
  rig.run(2s);
  EXPECT_FALSE(rig.state()->enabled);
}

TEST(M31, TheDeadlineOfTheCallShortensIt) {
  Rig rig(kept());
  rig.ready();
  rig.journal.slow = true;
  auto asked = options(rig, "r");
  asked.call_deadline = rig.world.now() + 300ms;
  const auto move = rig.submit(MoveAbsoluteRequest{.position = 100}, asked);
  rig.run(310ms);
  expect_late(move, "the call's deadline");
  rig.journal.release();
  rig.run(1s);
  EXPECT_EQ(rig.triggers(), 0);
}

/// Wherever the process is stopped before the start frame.
TEST(M31, APausedProcessStartsNothingLate) {
  for (Duration after = 0ms; after <= 40ms; after += 1ms) {
    Rig rig(kept());
    rig.ready();
    rig.line->forget_wire();
    const auto move = rig.submit(MoveAbsoluteRequest{.position = 100}, options(rig, "r"));
    rig.run(after);
    if (rig.triggers() > 0) break;
    pause(rig, 3s);
    rig.run(5s);
    EXPECT_EQ(rig.triggers(), 0) << after.count();
    EXPECT_EQ(move->value().state, CommandState::aborted) << describe(move->value());
    EXPECT_EQ(move->value().cause->reason, Reason::expired);
  }
}

TEST(M31, AFullLineIsTold) {
  auto base = kept();
  base.adjust = [](AxisSettings& axis) { axis.start_within = 16ms; };  // less than its chain takes
  Rig rig(base);
  rig.complete(SetPositionRequest{.position = 0});
  rig.line->forget_wire();
  const auto enable = rig.submit(EnableRequest{}, options(rig, "e"));
  rig.run(2s);
  ASSERT_EQ(enable->value().state, CommandState::done) << describe(enable->value());
  const auto move = rig.submit(MoveAbsoluteRequest{.position = 100}, options(rig, "r"));
  rig.run(2s);
  expect_late(move, "for its line");
  EXPECT_EQ(rig.triggers(), 0);
}

/// The ramp of the motion before it is the drive's: it counts beside the bound, and no longer than it takes.
TEST(M31, ALongDecelerationBeforeItIsNoLateness) {
  auto base = kept();
  base.adjust = [](AxisSettings& axis) {
    axis.limits.acceleration_time = 2s;
    axis.limits.deceleration_time = 2s;
    axis.start_within = 500ms;
  };
  for (const bool paused : {false, true}) {
    Rig rig(base);
    rig.ready();
    rig.submit(MoveAbsoluteRequest{.position = 390}, options(rig, "first"));
    rig.run(2100ms);
    ASSERT_TRUE(rig.state()->moving);
    rig.line->forget_wire();
    const auto back = rig.submit(MoveAbsoluteRequest{.position = 10}, options(rig, "back"));
    rig.run(100ms);
    if (paused) pause(rig, 60s);
    rig.run(60s);
    EXPECT_EQ(rig.triggers(), paused ? 0 : 1);
    if (paused)
      EXPECT_EQ(back->value().cause->reason, Reason::expired) << describe(back->value());
    else
      EXPECT_EQ(back->value().state, CommandState::done) << describe(back->value());
  }
}

/// Nor is the time until it is known that the motion before it does not begin any more (M9).
TEST(M31, TheTimeThatAnUnseenStartMayStillTakeIsNoLateness) {
  auto base = kept();
  base.adjust = [](AxisSettings& axis) {
    axis.limits.acceleration_time = 50ms;
    axis.limits.deceleration_time = 50ms;
    axis.stop_margin = 100ms;
    axis.start_within = 200ms;
  };
  Rig rig(base);
  rig.ready();
  rig.fault({.kind = simulation::FaultKind::drop_request, .function = 0x06, .register_address = 0x0027});
  const auto lost = rig.submit(MoveAbsoluteRequest{.position = 300}, options(rig, "lost"));
  ASSERT_TRUE(rig.run_until([&] { return rig.triggers() > 0; }, 1s));
  const auto next = rig.submit(MoveAbsoluteRequest{.position = 20}, options(rig, "next"));
  ASSERT_TRUE(rig.run_until([&] { return next->has_ended(); }, 10s));
  EXPECT_EQ(next->value().state, CommandState::done) << describe(next->value());
}

TEST(M31, WhatWaitsInTheBufferHasItsBoundFromItsTurn) {
  for (const bool slow : {false, true}) {
    Rig rig(kept());
    rig.ready();
    rig.submit(MoveAbsoluteRequest{.position = 300, .with = {.velocity = 30}}, options(rig, "first"));
    auto asked = options(rig, "second");
    asked.buffer_mode = BufferMode::buffered;
    asked.call_deadline = rig.world.now() + 1s;
    const auto second = rig.submit(MoveAbsoluteRequest{.position = 100}, asked);
    rig.run(5s);
    EXPECT_EQ(second->value().state, CommandState::accepted) << describe(second->value());
    rig.journal.slow = slow;
    rig.run(30s);
    rig.journal.release();
    rig.run(10s);
    if (slow)
      expect_late(second, "for the disk");
    else
      EXPECT_EQ(second->value().state, CommandState::done) << describe(second->value());
  }
}

/// The second start of a homing that backs off first has the same bound, from the end of the first.
TEST(M31, AHomingThatBackedOffIsNotGoneOnWithLate) {
  Rig rig(kept());
  rig.ready();
  rig.set_input("X0", true);
  rig.run(500ms);
  const auto homing = rig.submit(HomeRequest{}, options(rig, "h"));
  ASSERT_TRUE(rig.run_until([&] { return rig.triggers() > 0 && rig.state()->moving; }, 10s));
  rig.set_input("X0", false);
  rig.store.slow = true;
  rig.line->forget_wire();
  rig.run(30s);
  rig.store.release();
  rig.run(30s);
  EXPECT_EQ(homing->value().state, CommandState::aborted) << describe(homing->value());
  EXPECT_EQ(homing->value().cause->reason, Reason::expired) << describe(homing->value());
  EXPECT_EQ(rig.writes_of(0x0030), 0);
}

/// The core was held up, or the whole process: the call had arrived long before.
TEST(M31, WhatArrivedTooLongAgoIsRefusedAndHaltsNothing) {
  Rig rig(kept());
  rig.ready();
  const auto first = rig.submit(MoveAbsoluteRequest{.position = 300}, options(rig, "first"));
  rig.run(1s);
  auto asked = options(rig, "late");
  asked.arrived -= 2100ms;
  const auto late = rig.try_submit(MoveAbsoluteRequest{.position = 100}, asked);
  ASSERT_FALSE(late);
  EXPECT_EQ(late.error().reason, Reason::expired);
  rig.run(20s);
  EXPECT_EQ(first->value().state, CommandState::done) << describe(first->value());
}

/// All members of a group within one bound: a second of them is not started late, either.
TEST(M31, AGroupIsStartedInTimeOrNotAtAll) {
  int late_ones = 0;
  for (Duration after = 0ms; after <= 120ms; after += 3ms) {
    GroupRig rig;
    auto asked = CommandOptions{.client = "a", .request_id = "g", .arrived = rig.world.now()};
    const std::map<std::string, int> before = {{"x", rig.starts("x")}, {"y", rig.starts("y")}};
    const auto move = rig.move(GroupRig::to({{"x", 50}, {"y", 100}}, false), asked);
    rig.run(after);
    std::map<std::string, int> paused_at;
    for (const auto* axis : {"x", "y"}) paused_at[axis] = rig.starts(axis);
    if (paused_at["x"] > before.at("x") && paused_at["y"] > before.at("y")) break;
    rig.world.clock().advance_to(rig.world.now() + 5s);
    rig.run(10s);
    for (const auto* axis : {"x", "y"}) EXPECT_EQ(rig.starts(axis), paused_at[axis]) << axis << after.count();
    EXPECT_NE(move->state(), CommandState::done);
    ++late_ones;
  }
  EXPECT_GT(late_ones, 5);
}

}  // namespace
}  // namespace axisd::test
