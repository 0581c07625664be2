// What becomes of an axis when a lease ends, in the corners: while it decelerates, is being enabled or is
// silent, and where others come between (M16).
#include <gmock/gmock.h>

#include "tests/rules/leased_rig.hpp"

namespace axisd::test {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

/// Releases the lease of "a" under which the axis was commanded.
void release(LeasedRig& rig, std::uint64_t token) {
  EXPECT_TRUE(rig.machine->leases().release({.client = "a", .lease_token = token}));
}

TEST(M16LeaseEnd, AnAxisThatDeceleratesIsNotShownAtRest) {
  LeasedRig rig;
  const auto token = rig.lease("a", false, 10s);
  rig.submit(MoveAbsoluteRequest{.position = 390, .with = {.deceleration_time = 2000ms}},
             {.client = "a", .lease_token = token});
  rig.run(1s);
  rig.submit(StopRequest{.kind = StopKind::halt}, {.client = "a"});
  rig.run(100ms);
  release(rig, token);
  EXPECT_EQ(rig.state()->state, AxisState::discrete_motion);
  bool early = false;
  EXPECT_TRUE(rig.run_until(
      [&] {
        const auto state = rig.state();
        early = early || (state->state == AxisState::standstill && state->moving);
        return state->state == AxisState::standstill;
      },
      5s));
  EXPECT_FALSE(early);
}

TEST(M16LeaseEnd, AStopOnlyPutsOffTheRelease) {
  LeasedRig rig(LeaseLoss::disable);
  std::uint64_t token = 0;
  const auto move = rig.move_under_lease(token);
  release(rig, token);
  rig.run(5ms);
  rig.submit(StopRequest{}, {.client = "b"});
  EXPECT_EQ(rig.refused(EnableRequest{}, {.client = "b"}), Reason::stopping);
  rig.run(3s);
  expect_lost(move);
  EXPECT_FALSE(rig.state()->enabled);
  EXPECT_EQ(rig.state()->state, AxisState::disabled);
}

TEST(M16LeaseEnd, NothingNewComesBetweenLossAndRelease) {
  LeasedRig rig(LeaseLoss::disable);
  std::uint64_t token = 0;
  rig.move_under_lease(token);
  release(rig, token);
  rig.run(5ms);
  rig.submit(StopRequest{.kind = StopKind::halt}, {.client = "b"});
  for (int ms = 0; ms < 3000 && rig.state()->enabled; ++ms) {
    EXPECT_FALSE(rig.try_submit(MoveAbsoluteRequest{.position = 1}, {.client = "b"}));
    rig.run(1ms);
  }
  EXPECT_FALSE(rig.state()->enabled);
  rig.run(100ms);
  rig.enable();
  EXPECT_TRUE(rig.state()->enabled) << "whoever comes then may use it";
  rig.run(3s);
  EXPECT_TRUE(rig.state()->enabled) << "once is enough";
}

TEST(M16LeaseEnd, AnEnableOnItsWayIsReleasedAgain) {
  LeasedRig rig(LeaseLoss::disable);
  rig.complete(DisableRequest{});
  ASSERT_FALSE(rig.state()->enabled);
  for (const auto after : {0ms, 3ms, 6ms, 9ms, 12ms, 15ms, 20ms, 25ms, 30ms, 40ms}) {
    SCOPED_TRACE(after.count());
    const auto token = rig.lease("a");
    const auto enable = rig.submit(EnableRequest{}, {.client = "a", .lease_token = token});
    rig.run(after);
    release(rig, token);
    rig.run(3s);
    EXPECT_NE(enable->value().state, CommandState::accepted);
    EXPECT_FALSE(rig.state()->enabled);
    EXPECT_EQ(rig.state()->state, AxisState::disabled);
  }
}

TEST(M16LeaseEnd, ASilentDriveIsReleasedWhenItAnswersAgain) {
  LeasedRig rig(LeaseLoss::disable);
  const auto token = rig.lease("a", false, 10s);
  rig.fault({.kind = simulation::FaultKind::drop_request, .count = -1});
  EXPECT_TRUE(rig.run_until([&] { return rig.state()->link == LinkState::offline; }, 20s));
  rig.machine->leases().release({.client = "a", .lease_token = token});
  rig.run(1s);
  rig.faults().clear();
  rig.run(10s);
  EXPECT_EQ(rig.state()->link, LinkState::online);
  EXPECT_FALSE(rig.state()->enabled);
}

/// No token at all fits the gate again once the other's lease is over, too.
TEST(M16LeaseEnd, FinishStartsNothingMoreAfterTheTakersLease) {
  LeasedRig rig(LeaseLoss::finish, {.adjust_drive = [](simulation::SimulatedNodeSettings& node) {
                  node.mechanics.home_switch_from = -200;
                  node.mechanics.home_switch_to = 200;
                }});
  const auto home = rig.submit(HomeRequest{}, {.client = "a"});
  EXPECT_TRUE(rig.run_until([&] { return home->value().state == CommandState::active; }, 250ms));
  const auto token = rig.lease("b", true);
  rig.run(20ms);
  EXPECT_TRUE(rig.machine->leases().release({.client = "b", .lease_token = token}));
  rig.line->forget_wire();
  rig.run(20s);
  expect_lost(home);
  EXPECT_EQ(rig.load_mm(), 5) << "it backed off";
  EXPECT_EQ(rig.triggers(), 0);
}

TEST(M16LeaseEnd, ATakeOverFromACommandWithoutLeaseIsAnEvent) {
  LeasedRig rig;
  rig.submit(MoveAbsoluteRequest{.position = 300}, {.client = "a"});
  rig.run(300ms);
  rig.lease("b", true);
  const auto events = rig.lease_events();
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].what, LeaseChange::What::taken);
  EXPECT_EQ(events[0].before, "a");
  EXPECT_EQ(events[0].holder, "b");
}

/// The core may learn of the end after the gate has refused the frame.
TEST(M16LeaseEnd, WhatTheGateRefusesWasAborted) {
  LeasedRig rig;
  rig.complete(DisableRequest{});
  const auto token = rig.lease("a");
  const auto enable = rig.submit(EnableRequest{}, {.client = "a", .lease_token = token});
  rig.axis().gate()->set_fencing_token(token, rig.world.now());
  rig.run(500ms);
  expect_lost(enable);
  EXPECT_FALSE(rig.state()->enabled);
}

/// What a terminal moves was not commanded under the lease, and is not its holder's to end.
TEST(M16LeaseEnd, ATerminalsMotionGoesOn) {
  LeasedRig rig(LeaseLoss::halt,
                {.switches = {{"enabled_at_power_up", false}}, .adjust = [](AxisSettings& axis) {
                   axis.inputs.push_back({.terminal = "X4", .function = "jog_positive"});
                 }});
  const auto token = rig.lease("a");
  rig.set_input("X4", true);
  rig.run(300ms);
  ASSERT_EQ(rig.state()->motion_cause, MotionCause::terminal);
  rig.line->forget_wire();
  release(rig, token);
  rig.run(300ms);
  EXPECT_EQ(rig.writes_of(0x0028), 0);
  EXPECT_TRUE(rig.state()->moving);
  rig.set_input("X4", false);
}

TEST(M16LeaseEnd, EnablingWaitsForStandstill) {
  LeasedRig rig;
  rig.submit(MoveAbsoluteRequest{.position = 390, .with = {.deceleration_time = 2000ms}});
  rig.run(1s);
  rig.submit(StopRequest{.kind = StopKind::halt});
  rig.run(200ms);
  const auto refusal = rig.try_submit(EnableRequest{});
  ASSERT_FALSE(refusal);
  EXPECT_EQ(refusal.error().reason, Reason::moving);
  EXPECT_THAT(refusal.error().remedy, HasSubstr("standstill"));
  rig.run(3s);
  EXPECT_EQ(rig.complete(EnableRequest{}).state, CommandState::done);
}

}  // namespace
}  // namespace axisd::test
