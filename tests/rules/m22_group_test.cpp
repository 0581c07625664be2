// Groups: all members are ready before the first start, what fails at one stops all (M22).
#include <gmock/gmock.h>

#include <cmath>

#include "tests/rules/m22_group_rig.hpp"

namespace axisd::test {
namespace {

using simulation::FaultKind;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr std::uint16_t start_register = 0x0027, stop_register = 0x0028;

double in_ms(Duration time) { return std::chrono::duration<double, std::milli>(time).count(); }

const GroupMember& member(const GroupMove& move, std::string_view axis) {
  return *std::ranges::find_if(move.members, [&](const auto& m) { return m.command.axis == axis; });
}

TEST(M22Group, ThreeAxesOnTwoBusesArriveTogether) {
  for (const int baud : {115200, 9600}) {
    SCOPED_TRACE(baud);
    GroupRig rig({.baud = baud});
    auto request = GroupRig::to({{"x", 200}, {"y", 83.21}, {"z", 37.3}});
    request.max_arrival_error = 5ms;
    const auto run = rig.move(request);
    for (const auto* axis : {"x", "y", "z"})
      EXPECT_EQ(rig.state(axis)->state, AxisState::synchronized_motion) << axis;
    auto truth = rig.watch(4s);
    const auto move = run->value();
    ASSERT_EQ(move.state, CommandState::done) << (move.cause ? to_string(*move.cause) : "");
    EXPECT_LE(move.predicted_arrival_error, 5ms);
    TimePoint first = TimePoint::max(), last{};
    for (const auto& one : move.members) {
      const auto& axis = one.command.axis;
      SCOPED_TRACE(axis);
      EXPECT_EQ(one.command.kind, CommandKind::move_group);
      EXPECT_EQ(rig.starts(axis), 1);
      EXPECT_NEAR(in_ms(truth[axis].time()), in_ms(one.predicted), 15) << "first and last pulses are slow";
      EXPECT_EQ(one.by_sync, axis == "z") << one.note;
      first = std::min(first, *truth[axis].ended);
      last = std::max(last, *truth[axis].ended);
    }
    EXPECT_NEAR(rig.load_mm("x"), 200, 0.011);
    EXPECT_NEAR(rig.load_mm("y"), 83.21, 0.011);
    EXPECT_NEAR(rig.load_mm("z"), 37.3, 0.011);
    ASSERT_TRUE(move.start_skew && move.arrival_error);
    const auto starts = std::minmax({*truth["x"].begun, *truth["y"].begun, *truth["z"].begun});
    // The drives are told apart by when their shafts turn: they take the frame at its end.
    EXPECT_NEAR(in_ms(*move.start_skew), in_ms(starts.second - starts.first), 12);
    EXPECT_LT(*move.start_skew, baud == 9600 ? 150ms : 40ms);
    EXPECT_NEAR(in_ms(*move.arrival_error), in_ms(last - first), baud == 9600 ? 130 : 25)
        << "how often the drives are read";
  }
}

TEST(M22Group, WithoutScalingEachMovesAsItWould) {
  GroupRig rig;
  const auto move = rig.complete(GroupRig::to({{"x", 100}, {"y", 20}, {"z", 50}}, false));
  EXPECT_EQ(move.state, CommandState::done);
  EXPECT_NEAR(in_ms(member(move, "x").predicted), 1095, 20);
  EXPECT_LT(member(move, "y").predicted, 350ms);
  for (const auto& one : move.members) EXPECT_EQ(one.command.granted.velocity, 100);
}

TEST(M22Group, EveryMemberIsLookedAtBeforeTheFirstStarts) {
  GroupRig rig({.can_axes = 2});
  rig.complete(GroupRig::to({{"x", 20}, {"y", 20}, {"z", 20}, {"w", 20}}));
  const auto& wire = rig.line->wire();
  const auto first_start = std::ranges::find_if(
      wire, [](const auto& entry) { return entry.is_write() && entry.address() == start_register; });
  for (const std::uint8_t node : {1, 2}) {
    // The canary, the block, the state, the canary with the block, all before anything starts.
    const auto block = std::ranges::find_if(wire.begin(), first_start, [&](const auto& entry) {
      return entry.node() == node && entry.is_write() && entry.address() == 0x0020;
    });
    ASSERT_NE(block, first_start);
    EXPECT_GE(std::ranges::count_if(block, first_start,
                                    [&](const auto& e) { return e.node() == node && !e.is_write(); }),
              2);
  }
}

TEST(M22Group, WhatForbidsOneForbidsAll) {
  GroupRig rig;
  const auto refused = [&](const GroupMoveRequest& request) {
    rig.line->forget_wire();
    const auto run = rig.try_move(request);
    EXPECT_FALSE(run);
    EXPECT_EQ(rig.writes(1, start_register) + rig.writes(2, start_register), 0);
    for (const auto* axis : {"x", "y", "z"}) EXPECT_EQ(rig.state(axis)->state, AxisState::standstill);
    return run ? Error{} : run.error();
  };
  const auto beyond = refused(GroupRig::to({{"x", 20}, {"y", 500}, {"z", 20}}));
  EXPECT_EQ(beyond.reason, Reason::soft_limit);
  EXPECT_THAT(beyond.message, StartsWith("y: "));
  const auto nobody = refused(GroupRig::to({{"x", 20}, {"q", 5}}));
  EXPECT_EQ(nobody.reason, Reason::unknown_axis);
  EXPECT_EQ(nobody.message, "there is no axis 'q'");
  EXPECT_THAT(nobody.remedy, StartsWith("did you mean '"));
  EXPECT_EQ(refused(GroupRig::to({})).reason, Reason::invalid_argument);
  auto twice = GroupRig::to({{"x", 20}});
  twice.targets.push_back({.axis = "x", .distance = 1});
  EXPECT_EQ(refused(twice).reason, Reason::invalid_argument);
  auto unknown = GroupRig::to({{"x", 20}});
  unknown.group = "nobody";
  EXPECT_EQ(refused(unknown).reason, Reason::unknown_axis);
  // 1 r/min of a slow axis makes more than a millisecond.
  auto exact = GroupRig::to({{"x", 399.97}, {"y", 0.31}});
  exact.max_arrival_error = 1us;
  const auto error = refused(exact);
  EXPECT_EQ(error.reason, Reason::out_of_range) << to_string(error);
  EXPECT_THAT(error.message, HasSubstr("whole r/min"));
  const auto off = rig.machine->submit("y", DisableRequest{}, {});
  rig.run(1s);
  const auto disabled = rig.try_move(GroupRig::to({{"x", 20}, {"y", 20}, {"z", 20}}));
  ASSERT_FALSE(disabled);
  EXPECT_EQ(disabled.error().reason, Reason::disabled);
  EXPECT_THAT(disabled.error().message, StartsWith("y: "));
}

TEST(M22Group, AMemberThatMovesIsWaitedFor) {
  GroupRig rig;
  ASSERT_TRUE(rig.machine->submit("y", MoveAbsoluteRequest{.position = 50}, {}));
  rig.run(100ms);
  const auto run = rig.try_move(GroupRig::to({{"x", 20}, {"y", 20}}));
  ASSERT_FALSE(run);
  EXPECT_EQ(run.error().reason, Reason::moving);
  EXPECT_THAT(run.error().message, StartsWith("y: "));
}

/// y's start gets no reply: it may have been executed, and everything that may move is stopped at once.
TEST(M22Group, AnUnknownStartStopsAll) {
  for (const auto kind : {FaultKind::drop_reply, FaultKind::drop_request}) {
    SCOPED_TRACE(std::to_underlying(kind));
    GroupRig rig({.can_axes = 2});
    bool armed = false;
    rig.line->set_on_bind([&](const WireEntry& entry) {
      if (entry.node() != 2 || !entry.is_write() || entry.address() != start_register || armed) return;
      armed = true;
      rig.faults().add({.kind = kind, .node = 2, .count = 1});
    });
    const auto move = rig.complete(GroupRig::to({{"x", 200}, {"y", 100}, {"z", 50}, {"w", 50}}));
    ASSERT_TRUE(armed);
    EXPECT_EQ(move.state, CommandState::unknown);
    ASSERT_TRUE(move.cause);
    EXPECT_EQ(move.cause->where.node, 2);
    EXPECT_THAT(move.cause->message, StartsWith("y: "));
    EXPECT_EQ(member(move, "y").command.state, CommandState::unknown);
    EXPECT_EQ(member(move, "y").command.cause->outcome, Outcome::unknown);
    for (const auto* axis : {"x", "z", "w"}) {
      EXPECT_EQ(member(move, axis).command.state, CommandState::aborted) << axis;
      EXPECT_EQ(member(move, axis).command.cause->outcome, Outcome::unknown) << "it ran in part";
    }
    EXPECT_EQ(rig.writes(2, start_register), 1) << "never again";
    rig.run(1s);
    EXPECT_GT(rig.writes(1, stop_register), 0);
    EXPECT_GT(rig.writes(2, stop_register), 0);
    EXPECT_EQ(rig.state("y")->state, AxisState::error_stop);
    EXPECT_TRUE(rig.rests(5s));
    EXPECT_LT(rig.load_mm("x"), 30);
  }
}

TEST(M22Group, ARefusedStartStopsAllAndNoFurtherOneGoesOut) {
  GroupRig rig({.serial_switches = {{"start_refused_when_disabled", true}}});
  // x is told to start first; it refuses, in alarm.
  rig.line->set_on_bind([&, armed = false](const WireEntry& entry) mutable {
    if (entry.node() != 1 || !entry.is_write() || entry.address() != start_register || armed) return;
    armed = true;
    rig.serial(0).raise_alarm(1);
  });
  const auto move = rig.complete(GroupRig::to({{"x", 200}, {"y", 100}, {"z", 50}}));
  EXPECT_EQ(move.state, CommandState::error);
  EXPECT_EQ(member(move, "x").command.cause->reason, Reason::refused);
  EXPECT_EQ(member(move, "y").command.cause->outcome, Outcome::not_executed);
  EXPECT_EQ(rig.writes(2, start_register), 0);
  EXPECT_EQ(rig.starts("y"), 0);
  rig.run(1s);
  EXPECT_TRUE(rig.rests(3s));
  EXPECT_LT(rig.load_mm("z"), 10) << "it had been started, and was stopped";
}

/// Whenever a member is stopped: either nothing starts, or all that did is stopped, and nothing moves later.
TEST(M22Group, AStopOfOneMemberAtAnyTimeStopsAll) {
  for (const auto* victim : {"x", "y", "z"})
    for (auto when = 0ms; when < 130ms; when += 7ms) {
      SCOPED_TRACE(victim);
      SCOPED_TRACE(when.count());
      GroupRig rig({.can_axes = 2});
      const auto run = rig.move(GroupRig::to({{"x", 300}, {"y", 200}, {"z", 150}, {"w", 150}}));
      rig.run(when);
      rig.axis(victim).gate()->request_stop();
      rig.run(50us);
      ASSERT_TRUE(rig.machine->submit(victim, StopRequest{}, {}));
      ASSERT_TRUE(rig.run_until([&] { return ended(run->state()); }, 10s));
      rig.run(600ms);
      EXPECT_TRUE(rig.rests(3s));
      const auto move = run->value();
      for (const auto& one : move.members) {
        SCOPED_TRACE(one.command.axis + ": " + describe(one.command));
        EXPECT_EQ(one.command.state, CommandState::aborted);
        EXPECT_LE(rig.starts(one.command.axis), 1);
        if (one.command.axis != victim && rig.load_mm(one.command.axis) != 0)
          EXPECT_EQ(one.command.cause->outcome, Outcome::unknown);
      }
    }
}

TEST(M22Group, AFaultOnTheWayStopsAll) {
  GroupRig rig;
  const auto run = rig.move(GroupRig::to({{"x", 300}, {"y", 300}, {"z", 300}}));
  rig.run(500ms);
  EXPECT_EQ(run->state(), CommandState::active);
  rig.serial(1).raise_alarm(1);
  rig.run(1s);
  const auto move = run->value();
  EXPECT_EQ(move.state, CommandState::error);
  EXPECT_EQ(member(move, "y").command.cause->reason, Reason::alarm);
  ASSERT_TRUE(move.cause);
  EXPECT_EQ(move.cause->where.node, 2);
  EXPECT_THAT(move.cause->message, StartsWith("y: "));
  EXPECT_EQ(member(move, "x").command.state, CommandState::aborted);
  EXPECT_THAT(member(move, "z").command.cause->message, HasSubstr("alarm"));
  EXPECT_TRUE(rig.rests(3s));
  EXPECT_LT(rig.load_mm("x"), 80);
}

/// On a slow line the starts take long: who moves already is looked at between them.
TEST(M22Group, AFaultOfAStartedMemberEndsTheStartsOfTheOthers) {
  for (const bool silent : {false, true}) {
    SCOPED_TRACE(silent);
    GroupRig rig({.baud = 9600, .more_serial_axes = 6});
    rig.line->set_on_bind([&, armed = false](const WireEntry& entry) mutable {
      if (entry.node() != 12 || !entry.is_write() || entry.address() != start_register || armed) return;
      armed = true;
      if (silent)
        rig.faults().add({.kind = FaultKind::drop_request, .node = 11, .count = 12});
      else
        rig.serial(2).raise_alarm(1);
    });
    const auto move =
        rig.complete(GroupRig::to({{"a", 300}, {"b", 300}, {"c", 300}, {"d", 300}, {"e", 300}, {"f", 300}}));
    EXPECT_EQ(rig.starts("a") + rig.starts("b"), 2);
    EXPECT_EQ(rig.starts("c") + rig.starts("d") + rig.starts("e") + rig.starts("f"), 0);
    ASSERT_TRUE(move.cause);
    EXPECT_EQ(move.cause->where.node, 11) << to_string(*move.cause);
    EXPECT_EQ(member(move, "a").command.state, silent ? CommandState::unknown : CommandState::error)
        << describe(member(move, "a").command);
    EXPECT_EQ(member(move, "b").command.state, CommandState::aborted);
    rig.run(3s);
    EXPECT_TRUE(rig.rests(3s));
    EXPECT_LT(rig.load_mm("b"), 60);
  }
}

TEST(M22Group, ARestartBeforeTheStartStartsNobody) {
  GroupRig rig;
  rig.serial(0).advance(rig.world.now());
  rig.serial(0).set_power(false);
  rig.run(1ms);
  rig.serial(0).advance(rig.world.now());
  rig.serial(0).set_power(true);
  const auto run = rig.try_move(GroupRig::to({{"x", 20}, {"y", 20}, {"z", 20}}));
  ASSERT_TRUE(run);
  ASSERT_TRUE(rig.run_until([&] { return ended((*run)->state()); }, 20s));
  for (const auto* axis : {"x", "y", "z"}) EXPECT_EQ(rig.starts(axis), 0);
  EXPECT_EQ((*run)->value().cause->where.node, 1) << to_string(*(*run)->value().cause);
}

TEST(M22Group, WhereSyncDoesNotActTheyStartBackToBack) {
  GroupRig rig({.can_axes = 2, .can_switches = {{"rpdo_type_ignored", true}}});
  const auto move = rig.complete(GroupRig::to({{"x", 50}, {"z", 50}, {"w", 50}}));
  EXPECT_EQ(move.state, CommandState::done) << (move.cause ? to_string(*move.cause) : "");
  EXPECT_FALSE(member(move, "z").by_sync);
  EXPECT_THAT(member(move, "z").note, HasSubstr("SYNC"));
  for (const auto* axis : {"x", "z", "w"}) EXPECT_EQ(rig.starts(axis), 1);
}

TEST(M22Group, ARepeatGetsTheSameMove) {
  GroupRig rig;
  const auto request = GroupRig::to({{"x", 20}, {"y", 20}, {"z", 20}});
  const CommandOptions options{.client = "a", .request_id = "r1"};
  const auto run = rig.move(request, options);
  rig.run(100ms);
  EXPECT_EQ(rig.move(request, options), run);
  rig.run(3s);
  EXPECT_EQ(rig.move(request, options), run);
  EXPECT_EQ(run->state(), CommandState::done);
  for (const auto* axis : {"x", "y", "z"}) EXPECT_EQ(rig.starts(axis), 1);
  for (const auto& other :
       {GroupRig::to({{"x", 20}, {"y", 20}}), GroupRig::to({{"x", 20}, {"y", 20}, {"z", 21}}),
        GroupRig::to({{"x", 20}, {"y", 20}, {"z", 20}}, false)}) {
    const auto conflict = rig.try_move(other, options);
    ASSERT_FALSE(conflict);
    EXPECT_EQ(conflict.error().reason, Reason::request_id_conflict);
    EXPECT_THAT(conflict.error().message, StartsWith("x: "));
  }
  const auto alone = rig.machine->submit("x", MoveAbsoluteRequest{.position = 20}, options);
  ASSERT_FALSE(alone);
  EXPECT_EQ(alone.error().reason, Reason::request_id_conflict);
}

TEST(M22Group, AMemberAtItsTargetIsDoneWithoutAStart) {
  GroupRig rig;
  const auto move = rig.complete(GroupRig::to({{"x", 30}, {"y", 0}, {"z", 30}}));
  EXPECT_EQ(move.state, CommandState::done) << (move.cause ? to_string(*move.cause) : "");
  EXPECT_EQ(member(move, "y").predicted, Duration{});
  EXPECT_EQ(rig.starts("y"), 0);
  EXPECT_EQ(rig.starts("x"), 1);
  EXPECT_FALSE(member(move, "y").started_after);
}

TEST(M22Group, EveryMemberNeedsTheLease) {
  GroupRig rig;
  const auto grant = rig.machine->leases().acquire({.client = "a", .axes = {"x", "y", "z"}, .ttl = 1s});
  ASSERT_TRUE(grant);
  const auto request = GroupRig::to({{"x", 300}, {"y", 300}, {"z", 300}});
  const auto none = rig.try_move(request, {.client = "b"});
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().reason, Reason::lease_required);
  EXPECT_THAT(none.error().message, StartsWith("x: "));
  const auto run = rig.move(request, {.client = "a", .lease_token = grant->lease.token});
  ASSERT_TRUE(rig.run_until([&] { return ended(run->state()); }, 5s)) << "it is not renewed";
  for (const auto& one : run->value().members) EXPECT_EQ(one.command.state, CommandState::aborted);
  rig.run(600ms);
  EXPECT_TRUE(rig.rests(2s));
}

TEST(M22Group, ALeaseThatEndsBeforeTheStartStartsNobody) {
  for (auto ttl = 100ms; ttl < 130ms; ttl += 5ms) {
    SCOPED_TRACE(ttl.count());
    GroupRig rig({.baud = 9600});
    const auto grant = rig.machine->leases().acquire({.client = "a", .axes = {"y"}, .ttl = ttl});
    ASSERT_TRUE(grant);
    const auto run =
        rig.try_move(GroupRig::to({{"y", 100}}), {.client = "a", .lease_token = grant->lease.token});
    ASSERT_TRUE(run);
    ASSERT_TRUE(rig.run_until([&] { return ended((*run)->state()); }, 5s));
    rig.run(600ms);
    EXPECT_TRUE(rig.rests(1s));
    EXPECT_EQ((*run)->value().cause->reason, Reason::lease_lost) << to_string(*(*run)->value().cause);
  }
}

TEST(M22Group, RelativeMovesAndBack) {
  GroupRig rig;
  GroupMoveRequest request{.arrive_together = true};
  for (const auto* axis : {"x", "y", "z"}) request.targets.push_back({.axis = axis, .distance = 33.33});
  for (int i = 0; i < 3; ++i) EXPECT_EQ(rig.complete(request).state, CommandState::done);
  for (const auto* axis : {"x", "y", "z"}) EXPECT_NEAR(rig.load_mm(axis), 99.99, 0.011);
  EXPECT_EQ(rig.complete(GroupRig::to({{"x", 0}, {"y", 0}, {"z", 0}})).state, CommandState::done);
}

}  // namespace
}  // namespace axisd::test
