// Leases: who may command an axis, and what it does when the lease that it is commanded under ends (M16).
#include <gmock/gmock.h>

#include "tests/rules/leased_rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(M16Lease, EverythingThatMovesNeedsItWhileSomebodyHasIt) {
  LeasedRig rig;
  const auto token = rig.lease("a");
  const Action needing[] = {EnableRequest{},
                            HomeRequest{},
                            MoveAbsoluteRequest{.position = 1},
                            MoveRelativeRequest{.distance = 1},
                            MoveVelocityRequest{.velocity = 5},
                            JogRequest{.velocity = 5},
                            ResetRequest{},
                            SetPositionRequest{}};
  for (const auto& action : needing) {
    SCOPED_TRACE(to_string(kind_of(action)));
    EXPECT_EQ(rig.refused(action, {.client = "b"}), Reason::lease_required);
    EXPECT_EQ(rig.refused(action, {.client = "a"}), Reason::lease_required);
    EXPECT_EQ(rig.refused(action, {.client = "a", .lease_token = token + 1}), Reason::lease_lost);
    EXPECT_EQ(rig.refused(action, {.client = "b", .lease_token = token}), Reason::lease_required);
  }
  EXPECT_EQ(rig.state()->lease_holder, "a");
  const auto move = rig.submit(MoveRelativeRequest{.distance = 1}, {.client = "a", .lease_token = token});
  rig.run(1s);
  EXPECT_EQ(move->value().state, CommandState::done) << describe(move->value());
}

TEST(M16Lease, StopsAndDisableNeedNone) {
  for (const Action& action : {Action(StopRequest{.kind = StopKind::halt}), Action(StopRequest{}),
                               Action(StopRequest{.kind = StopKind::quick_stop}), Action(DisableRequest{})}) {
    SCOPED_TRACE(to_string(kind_of(action)));
    LeasedRig rig;
    std::uint64_t token = 0;
    const auto move = rig.move_under_lease(token);
    const auto stop = rig.submit(action, {.client = "b"});
    rig.run(1s);
    EXPECT_EQ(stop->value().state, CommandState::done) << describe(stop->value());
    EXPECT_EQ(move->value().state, CommandState::aborted);
    EXPECT_FALSE(rig.state()->moving);
    EXPECT_EQ(rig.state()->enabled, kind_of(action) != CommandKind::disable);
  }
  LeasedRig rig;
  std::uint64_t token = 0;
  const auto move = rig.move_under_lease(token);
  rig.machine->stop_all("b");
  rig.run(1s);
  EXPECT_EQ(move->value().state, CommandState::aborted);
  EXPECT_EQ(rig.refused(MoveAbsoluteRequest{.position = 1}, {.client = "a", .lease_token = token}),
            Reason::inhibited);
}

TEST(M16Lease, WhatIsNotRenewedHalts) {
  for (const auto on_loss : {LeaseLoss::halt, LeaseLoss::stop}) {
    LeasedRig rig(on_loss);
    std::uint64_t token = 0;
    const auto move = rig.move_under_lease(token);
    rig.run(1s);
    rig.renew("a", token);
    const auto ends = rig.world.now() + 2s;
    rig.run(1900ms);
    EXPECT_EQ(move->value().state, CommandState::active);
    EXPECT_EQ(rig.writes_of(0x0028), 0);
    rig.run(200ms);
    expect_lost(move);
    const auto& wire = rig.line->wire();
    const auto at = rig.first_write(0x0028);
    ASSERT_GE(at, 0);
    EXPECT_GE(wire[static_cast<std::size_t>(at)].begin, ends);
    EXPECT_LT(wire[static_cast<std::size_t>(at)].begin, ends + 30ms) << "one transaction may be in flight";
    EXPECT_EQ(wire[static_cast<std::size_t>(at)].value(), 0);
    EXPECT_EQ(rig.was_stopping(), on_loss == LeaseLoss::stop) << "a halt may be overridden, a stop may not";
    rig.run(1s);
    EXPECT_FALSE(rig.state()->moving);
    EXPECT_TRUE(rig.state()->enabled);
    EXPECT_EQ(rig.state()->state, AxisState::standstill);
    EXPECT_EQ(rig.state()->lease_holder, "");
    EXPECT_EQ(rig.refused(MoveAbsoluteRequest{.position = 1}, {.client = "a", .lease_token = token}),
              Reason::lease_lost);
    EXPECT_EQ(rig.complete(MoveAbsoluteRequest{.position = 1}).state, CommandState::done) << "free again";
  }
}

TEST(M16Lease, DisableStopsThenReleases) {
  LeasedRig rig(LeaseLoss::disable);
  std::uint64_t token = 0;
  const auto move = rig.move_under_lease(token);
  rig.run(3s);
  expect_lost(move);
  EXPECT_FALSE(rig.state()->moving);
  EXPECT_FALSE(rig.state()->enabled);
  EXPECT_EQ(rig.state()->state, AxisState::disabled);
}

TEST(M16Lease, FinishLetsABoundedMotionEnd) {
  LeasedRig rig(LeaseLoss::finish);
  std::uint64_t token = 0;
  const auto move = rig.move_under_lease(token);
  rig.run(6s);
  EXPECT_EQ(move->value().state, CommandState::done) << describe(move->value());
  EXPECT_EQ(rig.load_mm(), 390);
  EXPECT_EQ(rig.writes_of(0x0028), 0);
}

TEST(M16Lease, FinishHaltsMotionThatHasNoEndOfItsOwn) {
  for (const Action& action :
       {Action(MoveVelocityRequest{.velocity = 20}), Action(JogRequest{.velocity = 20, .hold = 2s})}) {
    for (const bool limits : {true, false}) {
      LeasedRig rig(LeaseLoss::finish, {.limits = limits});
      const auto token = rig.lease("a", false, 1s);
      const auto command = rig.submit(action, {.client = "a", .lease_token = token});
      rig.run(1500ms);
      expect_lost(command);
      rig.run(1s);
      EXPECT_FALSE(rig.state()->moving);
    }
  }
}

/// The move that is let finish is the last of it: a homing that was backing off does not go on to search.
TEST(M16Lease, FinishStartsNothingMore) {
  LeasedRig rig(LeaseLoss::finish, {.adjust_drive = [](simulation::SimulatedNodeSettings& node) {
                  node.mechanics.home_switch_from = -200;
                  node.mechanics.home_switch_to = 200;
                }});
  const auto token = rig.lease("a", false, 300ms);
  const auto home = rig.submit(HomeRequest{}, {.client = "a", .lease_token = token});
  EXPECT_TRUE(rig.run_until([&] { return home->value().state == CommandState::active; }, 250ms));
  rig.line->forget_wire();
  rig.run(20s);
  expect_lost(home);
  EXPECT_EQ(rig.load_mm(), 5) << "it backed off";
  EXPECT_EQ(rig.triggers(), 0);
}

/// Accepted under a lease and waiting behind a halt that decelerates: taken over meanwhile, it is never sent.
TEST(M16Lease, WhatWaitedUnderALeaseThatIsGoneIsNotSent) {
  for (const auto on_loss : {LeaseLoss::halt, LeaseLoss::stop, LeaseLoss::disable, LeaseLoss::finish}) {
    LeasedRig rig(on_loss);
    auto token = rig.lease("a");
    rig.submit(MoveAbsoluteRequest{.position = 390, .with = {.deceleration_time = 2000ms}},
               {.client = "a", .lease_token = token});
    rig.run(1s);
    const auto waiting =
        rig.submit(MoveAbsoluteRequest{.position = 1}, {.client = "a", .lease_token = token});
    rig.line->forget_wire();
    rig.run(200ms);
    rig.lease("b", true);
    rig.run(10s);
    expect_lost(waiting);
    EXPECT_THAT(waiting->value().cause->message, HasSubstr("b took the lease of a"));
    EXPECT_EQ(rig.triggers(), 0);
    EXPECT_FALSE(rig.state()->moving);
  }
}

/// The core may be late, the gate is not: in the queue and at the bind the time counts.
TEST(M16Lease, TheGateItselfKeepsTheTime) {
  AxisGate gate;
  const auto shared = std::shared_ptr<const AxisGate>(&gate, [](const AxisGate*) {});
  const TimePoint now{1h};
  gate.set_fencing_token(7, now + 1s);
  const MotionGuard under{.gate = shared, .epoch = gate.epoch(), .fencing_token = 7};
  EXPECT_EQ(may_send(under, now), Verdict::send);
  EXPECT_EQ(may_send(under, now + 1s), Verdict::lease_lost);
  gate.set_fencing_token(7, now + 3s);
  EXPECT_EQ(may_send(under, now + 1s), Verdict::send) << "renewed";
  gate.set_fencing_token(8, now + 3s);
  EXPECT_EQ(may_send(under, now), Verdict::lease_lost);
  MotionGuard anybody = under;
  anybody.fencing_token = MotionGuard::needs_no_lease;
  EXPECT_EQ(may_send(anybody, now + 10s), Verdict::send);
}

TEST(M16Lease, ATakeOverHaltsWhatTheOtherDid) {
  LeasedRig rig;
  std::uint64_t first = 0;
  const auto move = rig.move_under_lease(first);
  EXPECT_EQ(rig.machine->leases().acquire({.client = "b", .axes = {"feeder"}}).error().reason,
            Reason::lease_required);
  const auto second = rig.lease("b", true);
  EXPECT_LT(first, second);
  expect_lost(move);
  EXPECT_EQ(rig.state()->lease_holder, "b");
  EXPECT_EQ(rig.refused(MoveAbsoluteRequest{.position = 1}, {.client = "a", .lease_token = first}),
            Reason::lease_lost);
  // The halt may be overridden at once, by who has the lease now.
  const auto next = rig.submit(MoveAbsoluteRequest{.position = 5}, {.client = "b", .lease_token = second});
  rig.run(1s);
  rig.renew("b", second);
  rig.run(1500ms);
  EXPECT_EQ(next->value().state, CommandState::done) << describe(next->value());
  EXPECT_EQ(rig.load_mm(), 5);
  EXPECT_TRUE(rig.machine->leases().release({.client = "b", .lease_token = second}));
  const auto events = rig.lease_events();
  ASSERT_EQ(events.size(), 3U);
  EXPECT_EQ(events[0].what, LeaseChange::What::acquired);
  EXPECT_EQ(events[0].holder, "a");
  EXPECT_EQ(events[1].what, LeaseChange::What::taken);
  EXPECT_EQ(events[1].before, "a");
  EXPECT_EQ(events[1].holder, "b");
  EXPECT_EQ(events[2].what, LeaseChange::What::released);
  EXPECT_EQ(events[2].before, "b");
}

TEST(M16Lease, WhatWasBegunWithoutALeaseIsOnlyTaken) {
  LeasedRig rig;
  const auto move = rig.submit(MoveAbsoluteRequest{.position = 300}, {.client = "a"});
  rig.run(300ms);
  const auto refusal = rig.machine->leases().acquire({.client = "b", .axes = {"feeder"}});
  EXPECT_EQ(refusal.error().reason, Reason::busy);
  EXPECT_THAT(refusal.error().message, HasSubstr("of a"));
  EXPECT_EQ(move->value().state, CommandState::active);
  rig.lease("b", true);
  expect_lost(move);
  rig.run(1s);
  EXPECT_FALSE(rig.state()->moving);
}

TEST(M16Lease, AJogNeedsLeaseAndRenewal) {
  LeasedRig rig;
  const auto token = rig.lease("a", false, 10s);
  const CommandOptions options{.client = "a", .request_id = "j", .lease_token = token};
  const JogRequest jog{.velocity = 20, .hold = 300ms};
  const auto first = rig.submit(jog, options);
  for (int i = 0; i < 5; ++i) {
    rig.run(200ms);
    EXPECT_EQ(rig.submit(jog, options), first);
  }
  EXPECT_EQ(rig.state()->state, AxisState::continuous_motion);
  rig.run(1s);
  EXPECT_EQ(first->value().cause->reason, Reason::expired) << "its hold ended, though the lease did not";
  const auto second = rig.submit(jog, {.client = "a", .request_id = "k", .lease_token = token});
  rig.run(100ms);
  EXPECT_TRUE(rig.machine->leases().release({.client = "a", .lease_token = token}));
  expect_lost(second);
}

TEST(M16Lease, AnAxisAtRestIsLeftAlone) {
  LeasedRig rig;
  rig.lease("a", false, 500ms);
  rig.line->forget_wire();
  rig.run(1s);
  EXPECT_EQ(rig.writes_of(0x0028), 0);
  EXPECT_EQ(rig.state()->lease_holder, "");
  EXPECT_TRUE(rig.state()->enabled);
}

/// A disable that somebody asked for goes on whatever becomes of leases.
TEST(M16Lease, ADisableIsNobodysLease) {
  LeasedRig rig;
  std::uint64_t token = 0;
  rig.move_under_lease(token);
  const auto disable = rig.submit(DisableRequest{}, {.client = "b"});
  rig.lease("b", true);
  rig.run(2s);
  EXPECT_EQ(disable->value().state, CommandState::done) << describe(disable->value());
  EXPECT_FALSE(rig.state()->enabled);
}

TEST(M16Lease, TokensGrowOverRestartsAndLeasesDoNotSurviveThem) {
  Rig rig({.persistence = true});
  rig.store.saved.start_count = 5;
  rig.stop_daemon();
  rig.start_daemon();
  rig.enable();
  const auto before = rig.machine->leases().acquire({.client = "a", .axes = {"feeder"}})->lease.token;
  rig.store.saved.start_count = 6;
  rig.stop_daemon();
  rig.start_daemon();
  EXPECT_TRUE(rig.machine->leases().table().list().empty());
  EXPECT_EQ(rig.try_submit(ResetRequest{}, {.client = "a", .lease_token = before}).error().reason,
            Reason::lease_lost);
  EXPECT_GT(rig.machine->leases().acquire({.client = "a", .axes = {"feeder"}})->lease.token, before);
}

TEST(M16Lease, ControlLeasedMovesNothingWithoutOne) {
  Rig rig;
  rig.stop_daemon();
  rig.configuration.leases.required = true;
  rig.start_daemon();
  EXPECT_EQ(rig.try_submit(EnableRequest{}, {.client = "a"}).error().reason, Reason::lease_required);
  const auto token = rig.machine->leases().acquire({.client = "a", .axes = {"feeder"}})->lease.token;
  const auto enable = rig.submit(EnableRequest{}, {.client = "a", .lease_token = token});
  rig.run(1s);
  EXPECT_EQ(enable->value().state, CommandState::done) << describe(enable->value());
  rig.submit(StopRequest{}, {.client = "b"});
  rig.submit(DisableRequest{}, {.client = "b"});
  rig.run(1s);
  EXPECT_FALSE(rig.state()->enabled);
}

TEST(M16Lease, UnknownAxesAreNoLease) {
  Rig rig;
  EXPECT_EQ(rig.machine->leases().acquire({.client = "a", .axes = {"feeder", "nope"}}).error().reason,
            Reason::unknown_axis);
  EXPECT_EQ(rig.state()->lease_holder, "");
}

}  // namespace
}  // namespace axisd::test
