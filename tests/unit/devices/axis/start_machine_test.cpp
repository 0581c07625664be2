#include "devices/axis/start_machine.hpp"

#include <gtest/gtest.h>

namespace axisd {
namespace {

using State = StartMachine::State;

StartMachine ready() {
  StartMachine start;
  start.standstill();
  return start;
}

StartMachine begun() {
  auto start = ready();
  start.begun();
  return start;
}

TEST(StartMachine, WhatMovesIsHaltedFirst) {
  StartMachine start;
  EXPECT_EQ(start.state(), State::accepted);
  EXPECT_FALSE(start.waits());
  start.wait_for_halt();
  EXPECT_EQ(start.state(), State::halting);
  EXPECT_TRUE(start.waits());
  EXPECT_FALSE(start.may_run()) << "the ramps are those of the motion before it";
  start.standstill();
  EXPECT_EQ(start.state(), State::ready);
  EXPECT_TRUE(start.may_run());
  EXPECT_FALSE(start.waits()) << "its gate decides";
}

TEST(StartMachine, NothingOfItMayRunBeforeItIsNoted) {
  auto start = ready();
  EXPECT_TRUE(start.note());
  EXPECT_EQ(start.state(), State::noting);
  EXPECT_TRUE(start.waits());
  EXPECT_FALSE(start.may_run());
  EXPECT_TRUE(start.is_noted()) << "that is under way";
  start.noted();
  EXPECT_EQ(start.state(), State::ready);
}

TEST(StartMachine, WhatIsNotedDuringAHaltIsAcceptedAfterIt) {
  StartMachine start;
  start.wait_for_halt();
  EXPECT_TRUE(start.note());
  EXPECT_EQ(start.state(), State::noting);
  start.noted();
  EXPECT_EQ(start.state(), State::accepted);
}

TEST(StartMachine, StandstillIsLookedForTwiceWhereHomingBacksOff) {
  auto start = ready();
  start.standstill();
  EXPECT_EQ(start.state(), State::ready);
}

TEST(StartMachine, ItIsNotedOnce) {
  auto start = begun();
  ASSERT_TRUE(start.note());
  start.noted();
  start.begun();
  EXPECT_FALSE(start.note());
  EXPECT_EQ(start.state(), State::begun);
}

TEST(StartMachine, WhatStartsNoMotionIsNotedAndStaysAccepted) {
  StartMachine start;
  EXPECT_TRUE(start.note());
  start.noted();
  EXPECT_EQ(start.state(), State::accepted);
  start.wait_for_halt();
  EXPECT_FALSE(start.note());
}

TEST(StartMachine, WhatIsSetDownSendsNothingUntilItIsTakenUp) {
  StartMachine start;
  start.set_down();
  EXPECT_EQ(start.state(), State::set_down);
  EXPECT_TRUE(start.waits());
  EXPECT_TRUE(start.bides());
  EXPECT_TRUE(start.sends_nothing());
  EXPECT_FALSE(start.may_run());
  start.take_up();
  EXPECT_EQ(start.state(), State::accepted);
}

TEST(StartMachine, ItWaitsForItsTurn) {
  auto start = ready();
  start.queue();
  EXPECT_EQ(start.state(), State::queued);
  EXPECT_TRUE(start.waits());
  EXPECT_FALSE(start.may_run());
  start.has_turn();
  EXPECT_EQ(start.state(), State::ready);
}

TEST(StartMachine, AMemberOfAGroupIsLoadedAfterItsTurn) {
  StartMachine start;
  start.queue();
  start.has_turn();
  EXPECT_EQ(start.state(), State::accepted);
  start.about_to_start();
  EXPECT_EQ(start.state(), State::ready);
  start.not_started();
  EXPECT_EQ(start.state(), State::accepted);
}

TEST(StartMachine, HomingQueuesAgainAfterItsBackOff) {
  auto start = begun();
  start.queue();
  EXPECT_FALSE(start.may_run());
  start.has_turn();
  EXPECT_EQ(start.state(), State::ready);
}

TEST(StartMachine, SavingSomethingElseLeavesOpenWhatMayRun) {
  for (auto start : {ready(), begun()}) {
    start.save();
    EXPECT_EQ(start.state(), State::saving);
    EXPECT_TRUE(start.waits());
    EXPECT_TRUE(start.may_run());
    start.saved();
    EXPECT_EQ(start.state(), State::ready);
  }
  StartMachine member;
  member.save();
  EXPECT_EQ(member.state(), State::noting);
  member.saved();
  EXPECT_EQ(member.state(), State::accepted);
}

TEST(StartMachine, NothingIsSentWhileItWaitsForTheDiskOrItsTurn) {
  auto noting = ready(), queued = ready(), saving = ready(), halting = StartMachine();
  EXPECT_TRUE(noting.note());
  EXPECT_TRUE(noting.sends_nothing());
  queued.queue();
  EXPECT_TRUE(queued.sends_nothing());
  saving.save();
  EXPECT_TRUE(saving.sends_nothing());
  halting.wait_for_halt();
  for (const auto& start : {StartMachine(), halting, ready(), begun()}) EXPECT_FALSE(start.sends_nothing());
}

TEST(StartMachine, WhatHasBegunWaitsForNothing) {
  EXPECT_TRUE(begun().has_begun());
  EXPECT_TRUE(begun().may_run());
  EXPECT_FALSE(begun().waits());
}

}  // namespace
}  // namespace axisd
