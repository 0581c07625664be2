#include "devices/cia402/object_canary.hpp"

#include <gtest/gtest.h>

namespace axisd::cia402 {
namespace {

using State = ObjectCanary::State;
using Written = ObjectCanary::Written;

constexpr MotionBlock factory = {0, 60, 100, 100, 5};
constexpr MotionBlock first = {1000, 300, 150, 150, 5}, second = {2000, 300, 150, 150, 5};

const std::vector<MotionObject> objects = {
    {target, {0x607A, 0}}, {speed, {0x6081, 0}}, {acceleration, {0x6083, 0}}, {deceleration, {0x6084, 0}}};

ContinuityMark mark_of(const MotionBlock& block) {
  ObjectCanary canary(factory);
  canary.written(block);
  return canary.mark().value_or(ContinuityMark{});
}

class CanaryTest : public testing::Test {
 protected:
  ObjectCanary canary_{factory};
};

TEST_F(CanaryTest, NothingIsExpectedAtFirst) {
  EXPECT_EQ(canary_.state(), State::nothing);
  EXPECT_FALSE(canary_.expects_anything());
  EXPECT_FALSE(canary_.is_expected(factory));
  EXPECT_FALSE(canary_.mark());
}

TEST_F(CanaryTest, WhatWasWrittenIsExpected) {
  canary_.written(first);
  EXPECT_EQ(canary_.state(), State::block);
  EXPECT_TRUE(canary_.is(first));
  EXPECT_FALSE(canary_.is_expected(second));
}

TEST_F(CanaryTest, AMarkOfAnEarlierRunIsEnough) {
  canary_.expect_marks({mark_of(first), mark_of(second)});
  EXPECT_EQ(canary_.state(), State::marks);
  EXPECT_TRUE(canary_.is_expected(second));
  EXPECT_TRUE(canary_.blocks().empty());
  EXPECT_FALSE(canary_.mark()) << "which of them is not known";
  canary_.found(second, 0);
  EXPECT_TRUE(canary_.is(second));
  EXPECT_FALSE(canary_.is_expected(first));
}

TEST_F(CanaryTest, AWriteWithoutAReplyLeavesTwo) {
  canary_.written(first);
  canary_.note_write(first, second, Written::unknown);
  EXPECT_EQ(canary_.state(), State::either);
  EXPECT_TRUE(canary_.is_expected(first));
  EXPECT_TRUE(canary_.is_expected(second));
  EXPECT_FALSE(canary_.is(first));
  canary_.found(first, 0);
  EXPECT_TRUE(canary_.is(first));
}

TEST_F(CanaryTest, ARefusedWriteLeavesWhatStood) {
  canary_.written(first);
  canary_.note_write(first, second, Written::no);
  EXPECT_TRUE(canary_.is(first));
  canary_.note_write(first, second, Written::yes);
  EXPECT_TRUE(canary_.is(second));
}

TEST_F(CanaryTest, HalfwayWhatAPowerUpLeavesProvesNothing) {
  canary_.written(first);
  canary_.note_write(first, factory, Written::yes);
  EXPECT_EQ(canary_.state(), State::nothing);
  canary_.written(first);
  canary_.note_write(first, factory, Written::unknown);
  EXPECT_TRUE(canary_.is(first));
}

TEST_F(CanaryTest, AForgottenOneIsNotExpected) {
  canary_.written(first);
  canary_.forget();
  EXPECT_EQ(canary_.state(), State::nothing);
  canary_.expect_marks({mark_of(first)});
  canary_.forget();
  EXPECT_EQ(canary_.state(), State::nothing);
}

TEST_F(CanaryTest, MarksTakeThePlaceOfABlock) {
  canary_.written(first);
  canary_.expect_marks({mark_of(second)});
  EXPECT_FALSE(canary_.is_expected(first));
}

TEST_F(CanaryTest, MarksStayUntilTheBlockIsWrittenAnew) {
  canary_.expect_marks({mark_of(first)});
  canary_.rewrite();
  EXPECT_EQ(canary_.state(), State::marks);
  canary_.written(second);
  EXPECT_FALSE(canary_.is_expected(first));
}

TEST_F(CanaryTest, NoBlockIsLikeOneThatAPowerUpLeaves) {
  canary_.note_power_up(first);
  EXPECT_NE(canary_.distinct(factory), factory);
  EXPECT_NE(canary_.distinct(first), first);
  EXPECT_EQ(canary_.distinct(second), second);
}

TEST_F(CanaryTest, TheFactorysBlockIsKnownForEver) {
  for (int i = 1; i <= 20; ++i) canary_.note_power_up({i, 300, 150, 150, 5});
  EXPECT_NE(canary_.distinct(factory), factory);
  const MotionBlock newest = {20, 300, 150, 150, 5}, oldest = {1, 300, 150, 150, 5};
  EXPECT_NE(canary_.distinct(newest), newest);
  EXPECT_EQ(canary_.distinct(oldest), oldest);
}

TEST_F(CanaryTest, WhatWasSavedProvesNothing) {
  canary_.written(first);
  canary_.distrust(first);
  EXPECT_EQ(canary_.state(), State::nothing);
}

TEST_F(CanaryTest, TheFewestObjectsTellItFromAPowerUp) {
  const auto telling = canary_.telling(first, objects);
  ASSERT_EQ(telling.size(), 1U);
  EXPECT_EQ(telling.front().field, target);
  EXPECT_EQ(canary_.telling(factory, objects).size(), objects.size()) << "nothing tells it: all are read";
  canary_.note_power_up({1000, 60, 100, 100, 5});
  EXPECT_EQ(canary_.telling(first, objects).size(), 2U);
}

TEST_F(CanaryTest, EachStepOfAWriteHasAMark) {
  canary_.written(first);
  const MotionBlock wanted = {1500, 400, 150, 150, 5};
  const auto marks = canary_.marks_until(wanted);
  ASSERT_EQ(marks.size(), 3U);
  EXPECT_EQ(marks.front(), mark_of(first));
  EXPECT_EQ(marks.back(), mark_of(wanted));
  canary_.note_power_up({1500, 300, 150, 150, 5});
  EXPECT_EQ(canary_.marks_until(wanted).size(), 2U) << "halfway it is like after a power-up";
  canary_.forget();
  EXPECT_TRUE(canary_.marks_until(wanted).empty());
}

TEST_F(CanaryTest, AnotherMasterIsNoticed) {
  canary_.found(first, 7);
  EXPECT_FALSE(canary_.may_be_foreign(7));
  EXPECT_TRUE(canary_.may_be_foreign(8));
}

}  // namespace
}  // namespace axisd::cia402
