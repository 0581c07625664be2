#include "devices/axis/settlement.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace axisd {
namespace {

constexpr auto move = CommandKind::move_relative;

SendingNote note(std::int32_t start, std::int32_t target, std::int64_t tolerance = 0) {
  return {.start_pulses = start, .target_pulses = target, .tolerance_pulses = tolerance};
}

TEST(Settlement, AMoveIsToldByWhereTheDriveRests) {
  EXPECT_EQ(settle(move, note(100, 600), 600, true), Settlement::done);
  EXPECT_EQ(settle(move, note(100, 600), 100, true), Settlement::not_executed);
  EXPECT_EQ(settle(move, note(100, 600), 300, true), Settlement::in_part);
  EXPECT_EQ(settle(move, note(100, 600), 101, true), Settlement::in_part);
  EXPECT_EQ(settle(move, note(100, 100), 100, true), Settlement::done) << "there was nothing to do";
  EXPECT_EQ(settle(move, {}, 100, true), Settlement::unknown) << "nothing was noted";
}

TEST(Settlement, AMeasuredCounterThatOnlyWaversHasNotMoved) {
  constexpr std::int64_t window = 10;
  EXPECT_EQ(settle(move, note(100, 600, window), 102, true, window), Settlement::not_executed);
  EXPECT_EQ(settle(move, note(100, 600, window), 598, true, window), Settlement::done);
  EXPECT_EQ(settle(move, note(100, 600, window), 111, true, window), Settlement::in_part);
  EXPECT_EQ(settle(move, note(100, 105, window), 103, true, window), Settlement::unknown)
      << "both are within the window";
  const auto home = CommandKind::home;
  EXPECT_EQ(settle(home, note(500, 0, window), 497, true, window), Settlement::not_executed);
  EXPECT_EQ(settle(home, note(500, 0, window), 3, true, window), Settlement::in_part);
  EXPECT_EQ(settle(home, note(5, 0, window), 3, true, window), Settlement::unknown);
}

TEST(Settlement, ACounterThatAPowerUpLeavesProvesNothingByItself) {
  EXPECT_EQ(settle(move, note(0, 600), 0, false), Settlement::unknown);
  EXPECT_EQ(settle(move, note(600, 0), 0, false), Settlement::unknown);
  EXPECT_EQ(settle(move, note(0, 600), 0, true), Settlement::not_executed);
  EXPECT_EQ(settle(move, note(600, 0), 0, true), Settlement::done);
  EXPECT_EQ(settle(move, note(600, 0, 5), 4, false), Settlement::unknown);
  EXPECT_EQ(settle(move, note(100, 600), 600, false), Settlement::done);
}

TEST(Settlement, WithinTheToleranceNothingIsSaidThatMayBeWrong) {
  EXPECT_EQ(settle(move, note(100, 103, 5), 100, true), Settlement::unknown) << "both are near";
  EXPECT_EQ(settle(move, note(100, 103, 5), 103, true), Settlement::unknown);
  EXPECT_EQ(settle(move, note(100, 600, 5), 104, true), Settlement::unknown) << "it may have begun";
  EXPECT_EQ(settle(move, note(100, 600, 5), 100, true), Settlement::not_executed);
  EXPECT_EQ(settle(move, note(100, 600, 5), 597, true), Settlement::done);
  EXPECT_EQ(settle(move, note(100, 600, 5), 594, true), Settlement::in_part);
  EXPECT_EQ(settle(move, note(100, 106, 5), 106, true), Settlement::done);
}

TEST(Settlement, MotionWithoutATargetIsNeverDone) {
  const SendingNote endless{.start_pulses = 100};
  EXPECT_EQ(settle(CommandKind::move_velocity, endless, 100, true), Settlement::not_executed);
  EXPECT_EQ(settle(CommandKind::move_velocity, endless, 900, true), Settlement::in_part);
  EXPECT_EQ(settle(CommandKind::move_velocity, note(100, 600), 600, true), Settlement::in_part);
  EXPECT_EQ(settle(CommandKind::jog, note(100, 600), 600, true), Settlement::done);
}

TEST(Settlement, AHomingThatBeganWhereItEndsTellsNothing) {
  constexpr auto home = CommandKind::home;
  EXPECT_EQ(settle(home, note(700, 0), 700, true), Settlement::not_executed);
  EXPECT_EQ(settle(home, note(700, 0), 0, true), Settlement::in_part);
  EXPECT_EQ(settle(home, note(700, 0), 300, true), Settlement::in_part);
  EXPECT_EQ(settle(home, note(0, 0), 0, true), Settlement::unknown);
  EXPECT_EQ(settle(home, note(0, 0), -40, true), Settlement::in_part);
  EXPECT_EQ(settle(home, note(250, 250), 250, true), Settlement::unknown);
}

TEST(Settlement, TheCounterWraps) {
  constexpr auto most = std::numeric_limits<std::int32_t>::max();
  constexpr auto least = std::numeric_limits<std::int32_t>::min();
  EXPECT_EQ(settle(move, note(most, least + 99), least + 99, true), Settlement::done);
  EXPECT_EQ(settle(move, note(most, least + 99, 2), least + 1, true), Settlement::unknown);
  EXPECT_EQ(settle(move, note(most, least + 99), most, true), Settlement::not_executed);
}

}  // namespace
}  // namespace axisd
