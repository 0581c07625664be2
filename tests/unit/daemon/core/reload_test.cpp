// Another configuration for a machine that runs, in virtual time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/unit/daemon/core/reload_rig.hpp"

namespace axisd::core {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST_F(ReloadedMachine, WhatIsTheSameGoesOnMoving) {
  const auto run = machine_->submit("a1", MoveVelocityRequest{.velocity = 50}, options());
  ASSERT_TRUE(run);
  world_.run_for(500ms);
  const auto* before = machine_->find("a1");
  reload(slower(1));
  EXPECT_THAT(refusals_, IsEmpty());
  EXPECT_EQ(machine_->find("a1"), before);
  EXPECT_EQ((*run)->value().state, CommandState::active);
  ASSERT_TRUE(online("a2"));
  world_.run_for(1s);
  EXPECT_EQ((*run)->value().state, CommandState::active);
  EXPECT_TRUE(line_->network().node(1)->shaft_moving());
  EXPECT_EQ(line_->network().node(1)->starts(), 1);
  EXPECT_EQ(line_->network().node(2)->starts(), 0) << "M1: nothing by itself";
  EXPECT_EQ(writes(2, 0x000F), 0) << "the power stage is left alone";
  EXPECT_EQ(machine_->submit("a2", MoveVelocityRequest{.velocity = 60}, options()).error().reason,
            Reason::out_of_range)
      << "the new limit";
}

TEST_F(ReloadedMachine, TheSameAgainTouchesNothing) {
  const auto *first = machine_->find("a1"), *second = machine_->find("a2");
  const auto table = machine_->table();
  reload(configuration_);
  EXPECT_THAT(refusals_, IsEmpty());
  EXPECT_EQ(machine_->find("a1"), first);
  EXPECT_EQ(machine_->find("a2"), second);
  EXPECT_EQ(state("a1")->link, LinkState::online);
}

TEST_F(ReloadedMachine, IsRefusedAsAWholeWithEveryReason) {
  ASSERT_TRUE(machine_->submit("a1", MoveVelocityRequest{.velocity = 50}, options()));
  world_.run_for(500ms);
  auto wanted = slower(0);
  wanted.axes.at(1).axis.limits.velocity = 50;
  wanted.machine = "other";
  wanted.lines.front().baud = 57600;
  LeaseRequest lease{.client = "hmi", .axes = {"a2"}};
  ASSERT_TRUE(machine_->leases().acquire(lease));
  reload(wanted);
  EXPECT_THAT(reasons(), ElementsAre(Reason::not_supported, Reason::not_supported, Reason::moving,
                                     Reason::lease_required));
  EXPECT_THAT(refusals_.at(0).message, HasSubstr("machine changed"));
  EXPECT_THAT(refusals_.at(1).message, HasSubstr("buses.line-a changed (modbus_rtu.baud)"));
  EXPECT_THAT(refusals_.at(2).message, HasSubstr("a1: executes move_velocity"));
  EXPECT_EQ(state("a1")->link, LinkState::online) << "nothing was begun";
  EXPECT_EQ(state("a2")->link, LinkState::online);
  EXPECT_EQ(machine_->find("a1")->settings().limits.velocity, 100);
}

TEST_F(ReloadedMachine, AnErrorThatTheDriveDoesNotShowIsResetFirst) {
  line_->network().node(2)->set_power(false);
  ASSERT_TRUE(world_.run_until([this] { return state("a2")->link == LinkState::offline; }, 10s));
  reload(slower(1));
  EXPECT_THAT(refusals_, IsEmpty()) << "an axis that rested when it fell silent may be exchanged";
  ASSERT_TRUE(machine_->submit("a1", MoveVelocityRequest{.velocity = 50}, options()));
  world_.run_for(500ms);
  line_->network().node(1)->set_power(false);
  ASSERT_TRUE(world_.run_until([this] { return state("a1")->link == LinkState::offline; }, 10s));
  reload(slower(0));
  EXPECT_THAT(reasons(), ElementsAre(Reason::stopping, Reason::fault))
      << "a stop is owed, its outcome unknown";
}

TEST_F(ReloadedMachine, OnlyItsHolderChangesALeasedAxis) {
  complete("a2", DisableRequest{});
  const auto lease = machine_->leases().acquire({.client = "fitter", .axes = {"a2"}, .ttl = 10s});
  ASSERT_TRUE(lease);
  reload(slower(1), "somebody");
  EXPECT_THAT(reasons(), ElementsAre(Reason::lease_required));
  auto without = configuration_;
  without.axes.pop_back();
  reload(without);
  EXPECT_THAT(reasons(), ElementsAre(Reason::lease_required)) << "released before the axis is gone";
  reload(slower(1));
  EXPECT_THAT(refusals_, IsEmpty());
  ASSERT_TRUE(online("a2"));
  EXPECT_EQ(machine_->find("a2")->gate()->fencing_token(), lease->lease.token) << "it lives on";
  EXPECT_TRUE(machine_->leases().renew({.client = "fitter", .lease_token = lease->lease.token}));
  EXPECT_EQ(machine_->submit("a2", MoveVelocityRequest{.velocity = 10}, options()).error().reason,
            Reason::lease_required);
}

/// Nobody would look after it any more, nor stop it; and nothing is configured under power.
TEST_F(ReloadedMachine, AnEnergisedAxisIsExchangedForKeysOfTheDaemonOnly) {
  auto without = configuration_;
  without.axes.pop_back();
  auto finer = configuration_;
  finer.axes.at(1).axis.scale.pulses_per_revolution = 2000;
  auto elsewhere = configuration_;
  elsewhere.axes.at(1).axis.node = 4;
  for (const auto& wanted : {without, finer, elsewhere}) {
    reload(wanted);
    EXPECT_THAT(reasons(), ElementsAre(Reason::busy));
    EXPECT_THAT(refusals_.front().remedy, HasSubstr("axisctl disable a2"));
  }
  line_->network().node(2)->set_power(false);
  ASSERT_TRUE(world_.run_until([this] { return state("a2")->link == LinkState::offline; }, 10s));
  reload(without);
  EXPECT_THAT(reasons(), ElementsAre(Reason::busy)) << "it may come back, and move by its terminals";
}

/// Whoever has used up the day's saves raises the limit without switching the power stage off.
TEST_F(ReloadedMachine, TheEepromsBudgetIsTheDaemonsAlone) {
  EXPECT_EQ(complete("a2", EnableRequest{}).state, CommandState::done);
  auto wanted = configuration_;
  wanted.axes.at(1).axis.limits.eeprom_saves_per_day = 7;
  reload(wanted);
  EXPECT_THAT(refusals_, IsEmpty());
  ASSERT_TRUE(online("a2"));
  EXPECT_EQ(machine_->find("a2")->settings().limits.eeprom_saves_per_day, 7U);
}

TEST_F(ReloadedMachine, AxesComeAndGoInTheOrderOfTheFile) {
  auto wanted = configuration_;
  wanted.axes.insert(wanted.axes.begin(), {.axis = axis(3)});
  wanted.groups.push_back({.name = "both", .axes = {"a1", "a3"}});
  const auto before = machine_->table();
  reload(wanted);
  EXPECT_THAT(refusals_, IsEmpty());
  EXPECT_THAT(machine_->table()->axes, ElementsAre("a3", "a1", "a2"));
  EXPECT_EQ(machine_->table()->groups.size(), 1U);
  EXPECT_THAT(before->axes, ElementsAre("a1", "a2")) << "whoever holds it still sees what it was";
  ASSERT_TRUE(online("a3"));
  EXPECT_EQ(line_->network().node(3)->starts(), 0);
  // Two axes that change places.
  for (const auto* axis : {"a1", "a2"}) complete(axis, DisableRequest{});
  wanted.axes.at(1).axis.node = 2;
  wanted.axes.at(2).axis.node = 1;
  reload(wanted);
  EXPECT_THAT(refusals_, IsEmpty());
  ASSERT_TRUE(online("a1"));
  ASSERT_TRUE(online("a2"));
  EXPECT_EQ(complete("a1", EnableRequest{}).state, CommandState::done);
  ASSERT_TRUE(machine_->submit("a1", MoveVelocityRequest{.velocity = 10}, options()));
  world_.run_for(500ms);
  EXPECT_TRUE(line_->network().node(2)->shaft_moving());
  EXPECT_FALSE(line_->network().node(1)->shaft_moving());
}

TEST_F(ReloadedMachine, ThePositionIsRestoredByWhatTheStoreKnowsNow) {
  EXPECT_EQ(complete("a2", EnableRequest{}).state, CommandState::done);
  EXPECT_EQ(complete("a2", SetPositionRequest{.position = 7}).state, CommandState::done);
  EXPECT_EQ(complete("a2", MoveAbsoluteRequest{.position = 12}).state, CommandState::done);
  reload(slower(1));
  ASSERT_TRUE(online("a2"));
  EXPECT_EQ(state("a2")->trust, PositionTrust::restored);
  EXPECT_DOUBLE_EQ(state("a2")->position, 12);
  EXPECT_EQ(state("a2")->state, AxisState::standstill);
  EXPECT_FALSE(state("a2")->enabled_by_us) << "M1: found energised";
  complete("a2", DisableRequest{});
  auto inverted = slower(1);
  inverted.axes.at(1).axis.scale.invert = true;
  reload(inverted);
  ASSERT_TRUE(online("a2"));
  EXPECT_EQ(state("a2")->trust, PositionTrust::unknown) << "the counter means something else";
  // Another drive than the one that the record speaks of.
  EXPECT_EQ(complete("a2", EnableRequest{}).state, CommandState::done);
  EXPECT_EQ(complete("a2", SetPositionRequest{.position = 7}).state, CommandState::done);
  complete("a2", DisableRequest{});
  auto moved = inverted;
  moved.axes.at(1).axis.node = 4;
  reload(moved);
  ASSERT_TRUE(online("a2"));
  EXPECT_EQ(state("a2")->trust, PositionTrust::unknown);
}

TEST_F(ReloadedMachine, ARepeatedRequestStillStartsNothing) {
  EXPECT_EQ(complete("a2", EnableRequest{}).state, CommandState::done);
  const auto move =
      machine_->submit("a2", MoveRelativeRequest{.distance = 5}, {.client = "hmi", .request_id = "once"});
  ASSERT_TRUE(move);
  ASSERT_TRUE(world_.run_until([&] { return (*move)->has_ended(); }, 10s));
  reload(slower(1));
  ASSERT_TRUE(online("a2"));
  const auto again =
      machine_->submit("a2", MoveRelativeRequest{.distance = 5}, {.client = "hmi", .request_id = "once"});
  ASSERT_TRUE(again);
  EXPECT_EQ((*again)->value().id, (*move)->value().id);
  world_.run_for(1s);
  EXPECT_EQ(line_->network().node(2)->starts(), 1);
}

TEST_F(ReloadedMachine, IsAnEvent) {
  const auto before = machine_->events().events_after(0, 0).newest;
  reload(slower(1));
  const auto batch = machine_->events().events_after(before, 100);
  const auto told = std::ranges::find_if(batch.events, [](const Event& event) {
    return std::holds_alternative<ConfigurationReloaded>(event.content);
  });
  ASSERT_NE(told, batch.events.end());
  const auto& content = std::get<ConfigurationReloaded>(told->content);
  EXPECT_EQ(content.client, "fitter");
  EXPECT_EQ(content.before, "r1");
  EXPECT_EQ(content.revision, "r2");
  ASSERT_EQ(content.changes.size(), 1U);
  EXPECT_EQ(to_string(content.changes.front()), "axes.a2 changed (limits.velocity)");
}

TEST_F(ReloadedMachine, TheEndOfTheDaemonEndsAReload) {
  ask(slower(1));
  const auto stop = machine_->submit("a2", StopRequest{}, {.client = "hmi"});
  machine_->close();
  ASSERT_TRUE(world_.run_until([this] { return machine_->closed() && answered_; }, 10s));
  EXPECT_EQ(refusals_.at(0).reason, Reason::cancelled);
  EXPECT_TRUE((*stop)->has_ended());
}

TEST_F(ReloadedMachine, OneSilentDriveDoesNotKeepTheOthers) {
  complete("a2", DisableRequest{});
  line_->network().node(2)->set_power(false);
  world_.run_for(3s);
  auto wanted = configuration_;
  wanted.axes.at(1).axis.node = 4;  // its address was wrong
  reload(wanted);
  EXPECT_THAT(refusals_, IsEmpty());
  EXPECT_TRUE(online("a2"));
  EXPECT_EQ(state("a1")->link, LinkState::online);
}

}  // namespace
}  // namespace axisd::core
