#include "devices/axis/continuity.hpp"

#include <gtest/gtest.h>

#include "devices/axis/settings.hpp"

namespace axisd {
namespace {

using namespace std::chrono_literals;
using State = Continuity::State;
using Pace = Continuity::Pace;

constexpr TimePoint proof{10s};
constexpr auto never = TimePoint::max();

Continuity proven() {
  Continuity continuity;
  continuity.proven(proof);
  return continuity;
}

TEST(Continuity, AProofGrowsOld) {
  const auto continuity = proven();
  EXPECT_EQ(continuity.state(proof), State::fresh);
  EXPECT_EQ(continuity.state(proof + continuity_period - 1ms), State::fresh);
  EXPECT_EQ(continuity.state(proof + continuity_period), State::due);
  EXPECT_EQ(continuity.state(proof + continuity_forgotten), State::due);
  EXPECT_EQ(continuity.state(proof + continuity_forgotten + 1ms), State::forgotten);
  EXPECT_FALSE(continuity.lost(proof + 2499ms));
  EXPECT_TRUE(continuity.lost(proof + 2500ms));
  EXPECT_TRUE(continuity.forgotten(proof + 2500ms));
}

TEST(Continuity, EachProofMakesItFreshAndAnOlderOneChangesNothing) {
  auto continuity = proven();
  continuity.proven(proof + 3s);
  EXPECT_EQ(continuity.state(proof + 3s), State::fresh);
  continuity.proven(proof + 1s);
  EXPECT_EQ(continuity.state(proof + 3s), State::fresh);
}

TEST(Continuity, ItIsJustProvenForHalfAPeriod) {
  EXPECT_TRUE(proven().just_proven(proof + continuity_period / 2 - 1ms));
  EXPECT_FALSE(proven().just_proven(proof + continuity_period / 2));
}

TEST(Continuity, InMotionItIsDueAfterAPeriodAndReadByTheLatest) {
  EXPECT_FALSE(proven().is_due(proof + continuity_period - 1ms, Pace::moving, never));
  EXPECT_TRUE(proven().is_due(proof + continuity_period, Pace::moving, never));
  EXPECT_EQ(proven().latest(true), proof + 950ms);
}

TEST(Continuity, WhereAnEndIsAwaitedItWaitsAsLongAsItMay) {
  EXPECT_FALSE(proven().is_due(proof + 949ms, Pace::awaiting_end, proof + 1ms));
  EXPECT_TRUE(proven().is_due(proof + 950ms, Pace::awaiting_end, never));
}

TEST(Continuity, AtRestItLeavesTimeForWhatWaitsForTheLine) {
  auto continuity = proven();
  EXPECT_EQ(continuity.latest(false), proof + 850ms);
  continuity.waited(100ms);
  EXPECT_EQ(continuity.latest(false), proof + 560ms);
  EXPECT_TRUE(continuity.is_due(proof + 560ms, Pace::at_rest, never));
  EXPECT_FALSE(continuity.is_due(proof + 560ms, Pace::moving, never));
  continuity.waited(10s);
  EXPECT_EQ(continuity.latest(false), proof + 200ms) << "however long others have kept the line";
}

TEST(Continuity, AWaitIsForgottenByAndBy) {
  auto continuity = proven();
  continuity.waited(100ms);
  continuity.waited(10ms);
  EXPECT_EQ(continuity.latest(false), proof + 635ms);
  continuity.waited(200ms);
  continuity.fade_waits();
  EXPECT_EQ(continuity.latest(false), proof + 410ms);
}

TEST(Continuity, WhatWasAskedForInVainIsDue) {
  EXPECT_TRUE(proven().is_due(proof + 710ms, Pace::at_rest, proof + 705ms));
  EXPECT_FALSE(proven().is_due(proof + 704ms, Pace::at_rest, proof + 705ms));
  auto later = proven();
  later.proven(proof + 705ms);
  EXPECT_FALSE(later.is_due(proof + 710ms, Pace::at_rest, proof + 705ms)) << "it was proven meanwhile";
}

TEST(Continuity, TheBusProvesItWithTheLastReadingThatIsInTime) {
  EXPECT_EQ(proven().due_beside(proof + 600ms, 100ms), never) << "another one comes";
  EXPECT_EQ(proven().due_beside(proof + 751ms, 100ms), proof + 751ms);
}

TEST(Continuity, TheBusProvesItBetweenTwoReadingsWhereTheyAreRare) {
  EXPECT_EQ(proven().due_beside(proof + 500ms, 1000ms), never) << "too soon to go with that one";
  EXPECT_EQ(proven().due_beside(proof + 1500ms, 1000ms), proof + 850ms);
}

TEST(Continuity, ItIsLookedAtOnAGridAndSoonWhereItIsBeyond) {
  EXPECT_EQ(proven().next_look(proof), proof + 2500ms);
  auto odd = proven();
  odd.proven(proof + 130ms);
  EXPECT_EQ(odd.next_look(proof + 200ms), proof + 2500ms);
  EXPECT_EQ(odd.next_look(proof + 2500ms), proof + 2630ms);
  EXPECT_EQ(odd.next_look(proof + 2700ms), proof + 2750ms);
}

}  // namespace
}  // namespace axisd
