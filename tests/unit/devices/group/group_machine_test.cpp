#include "devices/group/group_machine.hpp"

#include <gtest/gtest.h>

namespace axisd {
namespace {

using State = GroupMachine::State;

GroupMachine at(State state) {
  GroupMachine machine;
  if (state == State::given_up) {
    machine.give_up();
    return machine;
  }
  if (state == State::starting || state == State::following) machine.begin();
  if (state == State::following) machine.all_started();
  if (state == State::prepared || state == State::told || state == State::due) machine.prepared();
  if (state == State::told || state == State::due) machine.told();
  if (state == State::due) machine.all_told();
  EXPECT_EQ(machine.state(), state);
  return machine;
}

TEST(GroupMachine, WhatStartsAtOnceGoesFromPreparingToStarting) {
  auto machine = at(State::preparing);
  machine.begin();
  EXPECT_EQ(machine.state(), State::starting);
}

TEST(GroupMachine, WhatIsPreparedWaitsToBeTold) {
  auto machine = at(State::preparing);
  machine.prepared();
  EXPECT_EQ(machine.state(), State::prepared);
  machine.begin();
  EXPECT_EQ(machine.state(), State::prepared) << "it starts nothing untold";
}

TEST(GroupMachine, WhatIsToldIsDueOnceAllWereTold) {
  auto machine = at(State::prepared);
  machine.all_told();
  EXPECT_EQ(machine.state(), State::prepared) << "it was not told itself";
  machine.told();
  EXPECT_EQ(machine.state(), State::told);
  machine.begin();
  EXPECT_EQ(machine.state(), State::told) << "alone it starts nothing";
  machine.all_told();
  EXPECT_EQ(machine.state(), State::due);
  auto early = at(State::preparing);
  early.told();
  EXPECT_EQ(early.state(), State::preparing);
}

TEST(GroupMachine, WhatIsDueBegins) {
  auto machine = at(State::due);
  machine.begin();
  EXPECT_EQ(machine.state(), State::starting);
}

TEST(GroupMachine, WhatHasStartedIsFollowed) {
  auto machine = at(State::starting);
  machine.all_started();
  EXPECT_EQ(machine.state(), State::following);
  auto early = at(State::due);
  early.all_started();
  EXPECT_EQ(early.state(), State::due);
}

TEST(GroupMachine, AnythingIsGivenUpForGood) {
  for (const auto state :
       {State::preparing, State::prepared, State::told, State::due, State::starting, State::following}) {
    auto machine = at(state);
    machine.give_up();
    EXPECT_TRUE(machine.given_up());
    machine.prepared();
    machine.told();
    machine.all_told();
    machine.begin();
    machine.all_started();
    EXPECT_EQ(machine.state(), State::given_up);
  }
}

TEST(GroupMachine, ItIsRenewedFromWhenItWasTold) {
  for (const auto state : {State::preparing, State::prepared, State::given_up})
    EXPECT_FALSE(at(state).runs());
  for (const auto state : {State::told, State::due, State::starting, State::following})
    EXPECT_TRUE(at(state).runs());
}

}  // namespace
}  // namespace axisd
