// Stops, motion and leases that are asked for while axes are being exchanged, in virtual time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/unit/daemon/core/reload_rig.hpp"

namespace axisd::core {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;

TEST_F(ReloadedMachine, MotionIsRefusedWhileAnAxisIsExchanged) {
  const auto epoch = machine_->find("a2")->gate()->epoch();
  ask(slower(1));
  ASSERT_FALSE(answered_);
  const auto refused = machine_->submit("a2", MoveVelocityRequest{.velocity = 10}, options());
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, Reason::reloading);
  EXPECT_EQ(machine_->submit("a2", DisableRequest{}, options()).error().reason, Reason::reloading);
  const auto obstacles = machine_->find("a2")->explain({}, {});
  EXPECT_TRUE(std::ranges::any_of(obstacles, [](const Obstacle& each) {
    return each.blocking && each.error.reason == Reason::reloading && !each.error.remedy.empty();
  }));
  EXPECT_GT(machine_->find("a2")->gate()->epoch(), epoch) << "what was prepared is never sent";
  ask(slower(0));
  EXPECT_TRUE(answered_) << "one at a time";
  EXPECT_THAT(reasons(), ElementsAre(Reason::busy));
  answered_ = false;
  wanted_ = slower(1);
  ASSERT_TRUE(world_.run_until([this] { return answered_; }, 10s));
  ASSERT_TRUE(online("a2"));
  EXPECT_TRUE(machine_->submit("a2", MoveVelocityRequest{.velocity = 10}, options()));
}

TEST_F(ReloadedMachine, AStopMeanwhileIsExecutedByTheAxisThatComes) {
  ask(slower(1));
  const auto stop = machine_->submit("a2", StopRequest{.hold = true}, {.client = "hmi"});
  ASSERT_TRUE(stop);
  EXPECT_EQ(writes(2, 0x0028), 0);
  ASSERT_TRUE(world_.run_until([&] { return (*stop)->has_ended(); }, 10s));
  EXPECT_EQ((*stop)->value().state, CommandState::done);
  EXPECT_GE(writes(2, 0x0028), 1);
  EXPECT_EQ(state("a2")->holds.size(), 1U);
  EXPECT_EQ(state("a2")->state, AxisState::stopping);
}

TEST_F(ReloadedMachine, AHoldOutlivesTheExchangeOfItsAxis) {
  complete("a2", StopRequest{.hold = true});
  line_->forget_wire();
  reload(slower(1));
  EXPECT_THAT(refusals_, IsEmpty());
  ASSERT_TRUE(online("a2"));
  EXPECT_EQ(state("a2")->state, AxisState::stopping);
  ASSERT_EQ(state("a2")->holds.size(), 1U);
  EXPECT_EQ(machine_->submit("a2", MoveVelocityRequest{.velocity = 10}, options()).error().reason,
            Reason::stopping);
  EXPECT_EQ(line_->network().node(2)->starts(), 0);
}

TEST_F(ReloadedMachine, AnAxisThatWasRemovedAndComesBackIsHeldStill) {
  complete("a2", DisableRequest{});
  const auto with = configuration_;
  auto without = configuration_;
  without.axes.pop_back();
  ask(without);
  // While it is leaving: nobody has it any more, and still it counts.
  ASSERT_TRUE(machine_->submit("a2", StopRequest{.hold = true}, {.client = "hmi", .request_id = "r"}));
  ASSERT_TRUE(world_.run_until([this] { return answered_; }, 10s));
  EXPECT_EQ(machine_->find("a2"), nullptr);
  EXPECT_EQ(store_.saved.axes.at("a2").holds.size(), 1U);
  reload(with);
  ASSERT_TRUE(online("a2"));
  EXPECT_EQ(state("a2")->state, AxisState::stopping);
  EXPECT_EQ(machine_->submit("a2", EnableRequest{}, options()).error().reason, Reason::stopping);
  bool released = false;
  machine_->release_stop("a2", {.client = "hmi", .request_id = "r"},
                         [&](const auto& result) { released = result.has_value(); });
  ASSERT_TRUE(world_.run_until([&] { return released; }, 1s));
  EXPECT_EQ(complete("a2", EnableRequest{}).state, CommandState::done);
}

TEST_F(ReloadedMachine, StopAllMeanwhileStopsEveryAxis) {
  ask(slower(1));
  const auto stops = machine_->stop_all("hmi");
  ASSERT_EQ(stops.size(), 2U);
  for (const auto& stop : stops) {
    ASSERT_TRUE(stop);
    EXPECT_TRUE(world_.run_until([&] { return (*stop)->has_ended(); }, 10s));
    EXPECT_EQ((*stop)->value().state, CommandState::done);
  }
  EXPECT_GE(writes(2, 0x0028), 1);
  ASSERT_TRUE(online("a2"));
  EXPECT_TRUE(state("a2")->inhibited);
  EXPECT_FALSE(machine_->find("a2")->gate()->stop_pending());
}

TEST_F(ReloadedMachine, NobodyLeasesAnAxisMeanwhile) {
  complete("a2", DisableRequest{});
  auto without = configuration_;
  without.axes.pop_back();
  ask(without);
  const auto lease = machine_->leases().acquire({.client = "hmi", .axes = {"a1", "a2"}, .ttl = 1s});
  ASSERT_FALSE(lease);
  EXPECT_EQ(lease.error().reason, Reason::reloading);
  ASSERT_TRUE(world_.run_until([this] { return answered_; }, 10s));
  EXPECT_TRUE(machine_->leases().acquire({.client = "hmi", .axes = {"a1"}, .ttl = 1s}));
}

TEST_F(ReloadedMachine, AStopForAnAxisThatGetsAnotherDriveGoesToTheOneThatItHas) {
  complete("a2", DisableRequest{});
  line_->forget_wire();
  auto elsewhere = configuration_;
  elsewhere.axes.at(1).axis.node = 4;
  ask(elsewhere);
  const auto stop = machine_->submit("a2", StopRequest{}, {.client = "hmi"});
  ASSERT_TRUE(stop);
  ASSERT_TRUE(world_.run_until([this] { return answered_; }, 10s));
  EXPECT_EQ((*stop)->value().state, CommandState::done);
  EXPECT_GE(writes(2, 0x0028), 1);
}

TEST_F(ReloadedMachine, TheEndOfTheDaemonStillSendsAStopThatWaits) {
  ask(slower(1));
  const auto stop = machine_->submit("a2", StopRequest{}, {.client = "hmi"});
  ASSERT_TRUE(stop);
  machine_->stop_moving_axes();
  EXPECT_FALSE(machine_->at_rest());
  ASSERT_TRUE(world_.run_until([this] { return machine_->at_rest(); }, 10s));
  EXPECT_EQ((*stop)->value().state, CommandState::done);
  EXPECT_GE(writes(2, 0x0028), 1);
  EXPECT_THAT(reasons(), ElementsAre(Reason::cancelled));
  line_->forget_wire();
  const auto later = machine_->submit("a2", StopRequest{}, {.client = "hmi"});
  ASSERT_TRUE(later);
  ASSERT_TRUE(world_.run_until([&] { return (*later)->has_ended(); }, 10s));
  EXPECT_EQ((*later)->value().state, CommandState::done);
  EXPECT_GE(writes(2, 0x0028), 1);
}

TEST_F(ReloadedMachine, AStopMeanwhileDoesNotWaitForASilentDrive) {
  complete("a1", DisableRequest{});
  line_->network().node(1)->set_power(false);
  world_.run_for(20s);  // its node is held back for long
  auto wanted = slower(1);
  wanted.axes.at(0).axis.limits.velocity = 50;
  ask(wanted);
  line_->forget_wire();
  ASSERT_TRUE(machine_->submit("a2", StopRequest{}, {.client = "hmi"}));
  world_.run_for(60ms);
  EXPECT_GE(writes(2, 0x0028), 1);
  ASSERT_TRUE(world_.run_until([this] { return answered_; }, 20s));
  EXPECT_THAT(refusals_, IsEmpty());
}

TEST_F(ReloadedMachine, AStopForAnAxisThatGoesIsSentBeforeItIsGone) {
  complete("a2", DisableRequest{});
  line_->forget_wire();
  auto without = configuration_;
  without.axes.pop_back();
  ask(without);
  const auto stop = machine_->submit("a2", StopRequest{}, {.client = "hmi"});
  ASSERT_TRUE(stop);
  ASSERT_TRUE(world_.run_until([this] { return answered_; }, 10s));
  EXPECT_EQ((*stop)->value().state, CommandState::done);
  EXPECT_GE(writes(2, 0x0028), 1);
  EXPECT_EQ(machine_->submit("a2", StopRequest{}, {}).error().reason, Reason::unknown_axis);
  EXPECT_THAT(machine_->table()->axes, ElementsAre("a1"));
  line_->forget_wire();
  world_.run_for(2s);
  EXPECT_TRUE(std::ranges::none_of(line_->wire(), [](const auto& entry) { return entry.node() == 2; }));
}

}  // namespace
}  // namespace axisd::core
