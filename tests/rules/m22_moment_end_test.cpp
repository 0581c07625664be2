// What ends a group that waits for its moment, or runs since then (M22): nobody starts, or all are stopped.
#include <gmock/gmock.h>

#include "tests/rules/m22_moment_rig.hpp"
#include "tests/support/rig.hpp"

namespace axisd::test {
namespace {

using ::testing::HasSubstr;

TEST(M22MomentEnd, WhatIsNotToldEndsByItself) {
  MomentRig rig({.can_axes = 2});
  const auto run = rig.prepare({{"x", 50}, {"y", 50}, {"z", 50}, {"w", 50}});
  const auto prepared_at = rig.world.now();
  ASSERT_TRUE(rig.ends(run, 5s));
  EXPECT_NEAR(std::chrono::duration<double>(rig.world.now() - prepared_at).count(), 2, 0.01);
  const auto move = run->value();
  EXPECT_EQ(move.state, CommandState::aborted);
  EXPECT_EQ(move.cause->reason, Reason::expired) << cause_of(run);
  EXPECT_THAT(move.cause->message, HasSubstr("was not started"));
  const auto late = run->start_at(rig.world.now() + 300ms);
  ASSERT_FALSE(late);
  EXPECT_EQ(late.error().reason, Reason::expired);
  rig.expect_nothing_started(run);
  EXPECT_EQ(rig.complete(GroupRig::to({{"x", 5}, {"y", 5}, {"z", 5}, {"w", 5}})).state, CommandState::done);
}

/// Also to who asks in the moment in which it ends.
TEST(M22MomentEnd, ItsEndIsToldWithItsCause) {
  MomentRig rig;
  const auto run = rig.prepare({{"x", 50}, {"y", 50}});
  ASSERT_TRUE(rig.run_until([&] { return ended(run->state()); }, 5s));
  const auto move = run->value();
  EXPECT_EQ(move.state, CommandState::aborted);
  ASSERT_TRUE(move.cause);
  EXPECT_EQ(move.cause->reason, Reason::expired);
  rig.run(1ms);
  EXPECT_EQ(run->value().cause->message, move.cause->message);
}

/// While it waits its drives are read as those of any axis at rest: what happens to one ends the move.
TEST(M22MomentEnd, WhatHappensToAMemberThatWaitsEndsTheMove) {
  for (const bool told : {false, true}) {
    MomentRig rig;
    const auto run = rig.prepare({{"x", 50}, {"y", 50}, {"z", 50}});
    if (told) rig.tell(run, 1500ms);
    rig.serial(1).raise_alarm(1);
    rig.keep(run, 1200ms);
    ASSERT_TRUE(ended(run->state()));
    EXPECT_EQ(run->value().cause->where.node, 2) << cause_of(run);
    rig.expect_nothing_started(run);
  }
}

TEST(M22MomentEnd, ADriveThatRestartedInBetweenStartsNobody) {
  for (const auto before : {400ms, 110ms}) {
    SCOPED_TRACE(before.count());
    MomentRig rig;
    const auto run = rig.prepare({{"x", 50}, {"y", 50}, {"z", 50}});
    const auto at = rig.tell(run, 600ms);
    rig.keep(run, at - before - rig.world.now());
    rig.serial(1).advance(rig.world.now());
    rig.serial(1).set_power(false);
    rig.run(1ms);
    rig.serial(1).advance(rig.world.now());
    rig.serial(1).set_power(true);
    rig.keep(run, 1s);
    EXPECT_TRUE(ended(run->state()));
    EXPECT_EQ(rig.starts("y"), 0);
    EXPECT_EQ(rig.starts("x"), 0) << cause_of(run);
    EXPECT_TRUE(rig.rests(3s));
  }
}

TEST(M22MomentEnd, AStopOfAMemberAtAnyTimeStartsNobodyOrStopsAll) {
  for (const auto* victim : {"x", "z"})
    for (auto when = -420ms; when < 60ms; when += (when > -110ms ? 7ms : 61ms)) {
      SCOPED_TRACE(victim);
      SCOPED_TRACE(when.count());
      MomentRig rig({.can_axes = 2});
      const auto run = rig.prepare({{"x", 300}, {"y", 200}, {"z", 150}, {"w", 150}});
      const auto at = rig.tell(run, 450ms);
      rig.keep(run, at + when - rig.world.now());
      rig.axis(victim).gate()->request_stop();
      rig.run(50us);
      ASSERT_TRUE(rig.machine->submit(victim, StopRequest{}, {}));
      ASSERT_TRUE(rig.ends(run, 10s));
      rig.keep(run, 600ms);
      EXPECT_TRUE(rig.rests(2s));
      if (when < 0ms) EXPECT_EQ(rig.all_starts(), 0) << cause_of(run);
      for (const auto& one : run->value().members) {
        EXPECT_EQ(one.command.state, CommandState::aborted) << describe(one.command);
        EXPECT_LE(rig.starts(one.command.axis), 1);
      }
    }
}

/// Whoever coordinates it is gone: with its other machines, perhaps.
TEST(M22MomentEnd, WithoutRenewalsAllAreStopped) {
  MomentRig rig({.can_axes = 2});
  const auto run = rig.prepare({{"x", 300}, {"y", 300}, {"z", 300}, {"w", 300}});
  rig.tell(run);
  rig.keep(run, 1200ms);
  EXPECT_EQ(run->state(), CommandState::active);
  run->renew(GroupRenewal::all_told);
  rig.run(GroupRun::renewal_limit - 1ms);
  EXPECT_EQ(run->state(), CommandState::active);
  rig.run(2ms);
  const auto move = run->value();
  ASSERT_EQ(move.state, CommandState::aborted);
  EXPECT_THAT(move.cause->message, HasSubstr("has not renewed it"));
  for (const auto& one : move.members)
    EXPECT_EQ(one.command.cause->outcome, Outcome::unknown) << "it ran in part";
  rig.run(500ms);
  EXPECT_TRUE(rig.rests(3s));
  for (const auto* axis : {"x", "y", "z", "w"}) {
    EXPECT_GT(rig.load_mm(axis), 50);
    EXPECT_LT(rig.load_mm(axis), 299);
  }
}

TEST(M22MomentEnd, WithoutRenewalsBeforeTheMomentNobodyStarts) {
  MomentRig rig;
  const auto run = rig.prepare({{"x", 50}, {"y", 50}, {"z", 50}});
  rig.tell(run, 1900ms);
  EXPECT_TRUE(rig.rests(GroupRun::renewal_limit + 1ms));
  EXPECT_EQ(run->state(), CommandState::aborted);
  rig.expect_nothing_started(run);
}

/// The coordinator is gone after it told this machine, and before it told another one.
TEST(M22MomentEnd, AMachineThatIsToldAloneStartsNothing) {
  MomentRig rig({.can_axes = 2});
  const auto run = rig.prepare({{"x", 50}, {"y", 50}, {"z", 50}, {"w", 50}});
  rig.tell_alone(run, 600ms);
  rig.keep(run, 1s, GroupRenewal::waits);
  EXPECT_EQ(run->state(), CommandState::aborted);
  EXPECT_EQ(run->value().cause->reason, Reason::expired);
  EXPECT_THAT(run->value().cause->message, HasSubstr("other machines were told")) << cause_of(run);
  rig.keep(run, 1s);
  rig.expect_nothing_started(run);
}

TEST(M22MomentEnd, ThatAllWereToldCountsFromWhenThisOneWas) {
  MomentRig rig;
  const auto run = rig.prepare({{"x", 50}, {"y", 50}});
  run->renew(GroupRenewal::all_told);
  rig.tell_alone(run, 600ms);
  rig.keep(run, 1s, GroupRenewal::waits);
  EXPECT_EQ(run->state(), CommandState::aborted);
  rig.expect_nothing_started(run);
}

/// A move of somebody else's takes over, as it does from any other; a release ends it, too. Once, and nobody
/// follows.
TEST(M22MomentEnd, WhoeverCommandsAMemberOtherwiseEndsTheMove) {
  for (const bool told : {false, true})
    for (const bool moves : {true, false}) {
      SCOPED_TRACE(moves);
      MomentRig rig;
      const auto run = rig.prepare({{"x", 50}, {"y", 50}, {"z", 50}});
      if (told) rig.tell(run);
      rig.keep(run, 100ms);
      const auto other = moves ? rig.machine->submit("x", MoveAbsoluteRequest{.position = 7}, {.client = "b"})
                               : rig.machine->submit("x", DisableRequest{}, {.client = "b"});
      ASSERT_TRUE(other) << to_string(other.error());
      rig.keep(run, 3s);
      EXPECT_EQ(run->state(), CommandState::aborted) << cause_of(run);
      EXPECT_EQ((*other)->value().state, CommandState::done) << describe((*other)->value());
      EXPECT_EQ(rig.starts("x"), moves ? 1 : 0);
      EXPECT_EQ(rig.starts("y") + rig.starts("z"), 0);
      if (moves) EXPECT_NEAR(rig.load_mm("x"), 7, 0.011);
    }
}

/// Also where it is back before the moment.
TEST(M22MomentEnd, ABusThatIsLostStartsNobody) {
  for (const bool port : {true, false})
    for (const auto back : {300ms, 900ms}) {
      SCOPED_TRACE(port ? "the port closes" : "the cable is cut");
      MomentRig rig;
      const auto reach = [&](bool reachable) {
        port ? rig.line->set_open(reachable) : rig.line->network().set_connected(reachable);
      };
      const auto run = rig.prepare({{"x", 50}, {"y", 50}, {"z", 50}});
      rig.tell(run, 600ms);
      reach(false);
      rig.keep(run, back);
      reach(true);
      rig.keep(run, 3s);
      // A cable that was cut for as long as nothing had to be read was not missed.
      if (port || back > 600ms) EXPECT_EQ(rig.all_starts(), 0) << cause_of(run);
      if (port || back > 600ms) EXPECT_TRUE(ended(run->state())) << cause_of(run);
      if (port || back > 600ms) EXPECT_NE(run->state(), CommandState::done);
      for (const auto* axis : {"x", "y", "z"}) EXPECT_LE(rig.starts(axis), 1);
    }
}

/// Until shortly before its moment the line is everybody's.
TEST(M22MomentEnd, WhatWaitsForItsMomentKeepsNobodyFromStarting) {
  MomentRig rig({.more_serial_axes = 1});
  const auto run = rig.prepare({{"x", 50}, {"y", 50}});
  rig.tell(run, 1900ms);
  rig.keep(run, 500ms);
  ASSERT_TRUE(rig.machine->submit("a", MoveAbsoluteRequest{.position = 30}, {}));
  rig.keep(run, 150ms);
  EXPECT_EQ(rig.starts("a"), 1);
  rig.keep(run, 4s);
  EXPECT_EQ(run->state(), CommandState::done) << cause_of(run);
  for (const auto* axis : {"x", "y", "a"}) EXPECT_EQ(rig.starts(axis), 1);
}

TEST(M22MomentEnd, RenewalsProlongNoPreparation) {
  MomentRig rig;
  const auto run = rig.prepare({{"x", 50}, {"y", 50}});
  rig.keep(run, 2010ms);
  EXPECT_EQ(run->state(), CommandState::aborted);
  rig.expect_nothing_started(run);
}

TEST(M22MomentEnd, CancellingAMemberGivesItUp) {
  MomentRig rig;
  const auto run = rig.prepare({{"x", 50}, {"y", 50}, {"z", 50}});
  rig.tell(run);
  rig.run(100ms);
  ASSERT_TRUE(rig.axis("y").cancel(run->commands()[1]));
  rig.run(10ms);
  EXPECT_EQ(run->state(), CommandState::aborted);
  EXPECT_EQ(run->value().cause->reason, Reason::cancelled) << cause_of(run);
  rig.expect_nothing_started(run);
}

/// Also where it is released again before the moment.
TEST(M22MomentEnd, AStopOfTheMachineStartsNobody) {
  for (const bool told : {false, true}) {
    MomentRig rig({.can_axes = 2});
    const auto run = rig.prepare({{"x", 50}, {"y", 50}, {"z", 50}, {"w", 50}});
    if (told) rig.tell(run);
    rig.run(100ms);
    rig.machine->stop_all("a");
    rig.run(50ms);
    EXPECT_EQ(run->state(), CommandState::aborted) << cause_of(run);
    bool released = false;
    rig.machine->release_inhibit("a", [&](const Result<void>& result) { released = result.has_value(); });
    rig.keep(run, 1s);
    EXPECT_TRUE(released);
    rig.expect_nothing_started(run);
  }
}

TEST(M22MomentEnd, ALeaseThatEndsStartsNobody) {
  MomentRig rig;
  const auto grant = rig.machine->leases().acquire({.client = "a", .axes = {"x", "y", "z"}, .ttl = 1s});
  ASSERT_TRUE(grant);
  const auto run =
      rig.prepare({{"x", 50}, {"y", 50}, {"z", 50}}, {.client = "a", .lease_token = grant->lease.token});
  rig.tell(run, 1500ms);
  rig.keep(run, 1s);
  EXPECT_EQ(run->value().cause->reason, Reason::lease_lost) << cause_of(run);
  rig.expect_nothing_started(run);
}

/// Its commands are told as those of any move; nothing of it is started any more, whatever moment it was
/// told.
TEST(M22MomentEnd, ADaemonThatIsRestartedStartsNothing) {
  for (const auto before : {600ms, 400ms, 30ms, 1ms}) {  // the moment; 600 ms: it was not told
    SCOPED_TRACE(before.count());
    Rig rig({.persistence = true, .journal = true});
    rig.ready();
    const auto place = rig.load_mm();
    const GroupMoveRequest request{.targets = {{.axis = "feeder", .distance = 20}},
                                   .start = GroupStart::when_told};
    const CommandOptions options{.client = "hmi", .request_id = "r1"};
    auto run = rig.machine->groups().move(request, options);
    ASSERT_TRUE(run) << to_string(run.error());
    ASSERT_TRUE(rig.run_until([&] { return (*run)->prepared(); }, 5s));
    if (before < 600ms) {
      ASSERT_TRUE((*run)->start_at(rig.world.now() + 500ms));
      (*run)->renew(GroupRenewal::all_told);
      rig.run(500ms - before);
    }
    *run = nullptr;
    rig.kill_daemon();
    rig.idle(50ms);
    rig.start_daemon();
    rig.run(3s);
    const auto again = rig.machine->groups().move(request, options);
    ASSERT_TRUE(again) << to_string(again.error());
    EXPECT_EQ((*again)->state(), CommandState::aborted);
    const auto& command = (*again)->commands().front()->value();
    EXPECT_EQ(command.cause->outcome, Outcome::not_executed) << describe(command);
    EXPECT_EQ((*again)->start_at(rig.world.now() + 500ms).error().reason, Reason::invalid_argument);
    rig.run(2s);
    EXPECT_EQ(rig.load_mm(), place);
  }
}

/// The end of the daemon leaves nothing behind (the rig's destructor looks).
TEST(M22MomentEnd, ADaemonThatEndsStartsNothing) {
  for (const bool told : {false, true}) {
    MomentRig rig;
    const auto run = rig.prepare({{"x", 50}, {"y", 50}, {"z", 50}});
    if (told) rig.tell(run);
    rig.machine->close();
    rig.run(3s);
    EXPECT_EQ(rig.all_starts(), 0);
  }
}

}  // namespace
}  // namespace axisd::test
