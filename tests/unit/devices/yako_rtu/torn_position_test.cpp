// Which steps of the position the motor cannot have made.
#include "devices/yako_rtu/torn_position.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace axisd::yako_rtu {
namespace {

using namespace std::chrono_literals;

constexpr TimePoint start{1h};
constexpr double highest_rate = 200'000;

/// The reading that follows after `later` on one that showed `before`.
bool suspects(std::int32_t before, std::int32_t position, Duration later = 20ms) {
  TornPosition torn(highest_rate);
  torn.believe(before, start);
  return torn.suspects(position, start + later);
}

std::int32_t words(std::uint32_t high, std::uint32_t low) {
  return static_cast<std::int32_t>(high << 16U | low);
}

TEST(TornPosition, ACarryBetweenTheWordsIsSuspectInEitherDirection) {
  EXPECT_TRUE(suspects(-1, words(0x0000, 0xFFFF))) << "-1 or 0";
  EXPECT_TRUE(suspects(0, words(0xFFFF, 0x0000)));
  EXPECT_TRUE(suspects(65'535, words(0x0001, 0xFFFF)));
  EXPECT_TRUE(suspects(65'536, words(0x0000, 0x0000)));
  EXPECT_TRUE(suspects(65'000, words(0x0000, 200))) << "at speed";
  EXPECT_TRUE(suspects(std::numeric_limits<std::int32_t>::max(), words(0x8000, 0xFFFF)));
  EXPECT_TRUE(suspects(std::numeric_limits<std::int32_t>::min(), words(0x7FFF, 0x0000)));
}

TEST(TornPosition, OfTwoReadingsTheSecondIsRightUnlessBothAreTorn) {
  EXPECT_EQ(TornPosition::of_two(65'535, -1), -1);
  EXPECT_EQ(TornPosition::of_two(-65'536, 3), 3);
  EXPECT_EQ(TornPosition::of_two(0, 0), 0) << "it was cleared at 65536";
  EXPECT_EQ(TornPosition::of_two(65'535, -65'536), 0) << "-1, and then 0";
  EXPECT_EQ(TornPosition::of_two(-65'536, 65'535), -1);
  EXPECT_EQ(TornPosition::of_two(words(0x8000, 0xFFFF), words(0x7FFF, 0x0000)),
            std::numeric_limits<std::int32_t>::min());
}

TEST(TornPosition, WhatTheMotorCanDoIsNotSuspect) {
  for (const auto later : {1ms, 5ms, 20ms, 200ms}) {
    const auto way = static_cast<std::int32_t>(highest_rate * static_cast<double>(later / 1ms) / 1000);
    for (const auto from : {-way, -1, 0, 65'535})
      for (const auto step : {-way, -1, 0, 1, way})
        EXPECT_FALSE(suspects(from, from + step, later)) << from << ' ' << step;
  }
}

TEST(TornPosition, AnotherStepIsNoCarry) {
  EXPECT_FALSE(suspects(100'000, 0)) << "it was homed, cleared or restarted";
  EXPECT_FALSE(suspects(2 * 65'536, 0)) << "the words differ by one carry at most";
  EXPECT_FALSE(suspects(30'000, 0));
}

TEST(TornPosition, AtRestItIsSuspectHoweverLongAgoItWasRead) {
  EXPECT_TRUE(suspects(-1, 65'535, 1s));
  EXPECT_TRUE(suspects(2, words(0xFFFF, 0x0000), 1h));
  EXPECT_FALSE(suspects(-1, 64'000, 1s)) << "it can have gone there, and no carry is near";
  EXPECT_FALSE(suspects(-1, 2, 1s));
  TornPosition torn(highest_rate);
  EXPECT_TRUE(torn.suspects(65'535, start)) << "nothing was read before: it may be 0";
  EXPECT_FALSE(torn.suspects(1, start));
  EXPECT_FALSE(torn.suspects(100'000, start));
  torn.believe(-1, start);
  EXPECT_TRUE(torn.suspects(65'535, start + 20ms));
  torn.believe(70'000, start);
  torn.forget();
  EXPECT_FALSE(torn.suspects(4'464, start + 20ms));
}

}  // namespace
}  // namespace axisd::yako_rtu
