// Rest and motion by readings that waver.
#include "devices/cia402/standstill.hpp"

#include <gtest/gtest.h>

#include <array>
#include <vector>

namespace axisd::cia402 {
namespace {

using namespace std::chrono_literals;

constexpr Standstill::Gauge gauge{.window = 10, .pulses_per_revolution = 1000};
constexpr TimePoint start{1h};
constexpr std::array noise{0, 1, -1, 1, 0, -1, -1, 0, 1};

Standstill::Look look(Duration after, std::int32_t position, int velocity_rpm,
                      std::optional<bool> told = std::nullopt) {
  return {.at = start + after, .position = position, .velocity_rpm = velocity_rpm, .told = told};
}

TEST(Standstill, NoiseIsNoMotion) {
  Standstill standstill;
  for (std::size_t i = 0; i < 90; ++i) {
    const auto wavers = noise.at(i % noise.size());
    EXPECT_FALSE(standstill.moves(look(20ms * static_cast<int>(i), 500 + 2 * wavers, wavers), gauge)) << i;
  }
}

TEST(Standstill, AnExactPositionThatChangesIsAMotionAndRestsWhenItHasStayed) {
  constexpr Standstill::Gauge exact{.window = 0, .pulses_per_revolution = 1000};
  Standstill standstill;
  EXPECT_FALSE(standstill.moves(look(0ms, 500, 0), exact));
  EXPECT_TRUE(standstill.moves(look(20ms, 501, 0), exact)) << "by one pulse";
  for (auto after = 40ms; after < 140ms; after += 20ms)
    EXPECT_TRUE(standstill.moves(look(after, 501, 0), exact))
        << "the next pulse may be due " << after.count();
  EXPECT_FALSE(standstill.moves(look(140ms, 501, 0), exact));
}

TEST(Standstill, AVelocityBeyondItsNoiseIsAMotionWhateverTheDriveSays) {
  for (const int rpm : {2, -2, 500}) {
    Standstill standstill;
    EXPECT_TRUE(standstill.moves(look(0ms, 0, rpm, false), gauge));
  }
}

/// In position by its own word it still turns a little, and noise comes on top.
TEST(Standstill, TheLastOfASettlingIsNoMotion) {
  Standstill standstill;
  EXPECT_TRUE(standstill.moves(look(0ms, 0, 40, false), gauge));
  EXPECT_TRUE(standstill.moves(look(10ms, 6, 2, false), gauge)) << "it was not at rest yet";
  EXPECT_FALSE(standstill.moves(look(20ms, 7, 1, false), gauge));
  EXPECT_FALSE(standstill.moves(look(30ms, 7, 2, false), gauge));
  EXPECT_FALSE(standstill.moves(look(40ms, 8, 3, false), gauge));
  EXPECT_FALSE(standstill.moves(look(50ms, 8, 0, false), gauge));
  EXPECT_TRUE(standstill.moves(look(60ms, 8, 4, false), gauge)) << "that is more than both";
}

/// By its own threshold a velocity of 20 r/min is noise: then the position tells.
TEST(Standstill, WithinTheDrivesOwnThresholdThePositionTells) {
  constexpr Standstill::Gauge coarse{.window = 10, .pulses_per_revolution = 1000, .noise_rpm = 20};
  for (const auto told : {std::optional<bool>(), std::optional(false)}) {
    Standstill standstill;
    for (int i = 0; i < 90; ++i)
      EXPECT_FALSE(standstill.moves(look(20ms * i, 500 + i % 3, i % 2 == 0 ? 20 : -20, told), coarse)) << i;
    EXPECT_TRUE(standstill.moves(look(1800ms, 520, 15, told), coarse)) << "it has left its place";
    EXPECT_TRUE(standstill.moves(look(1900ms, 521, -15, told), coarse));
    EXPECT_FALSE(standstill.moves(look(2500ms, 521, 15, told), coarse)) << "it has stayed";
    EXPECT_TRUE(standstill.moves(look(2520ms, 521, 70, told), coarse)) << "more than noise and settling";
  }
  Standstill standstill;
  EXPECT_FALSE(standstill.moves(look(0ms, 500, 0, false), coarse));
  EXPECT_TRUE(standstill.moves(look(20ms, 500, 10, true), coarse)) << "the drive says that it moves";
}

/// Whatever the threshold, a slow turn leaves the place in the end.
TEST(Standstill, AHandThatTurnsWithinTheThresholdIsFoundOut) {
  constexpr Standstill::Gauge coarse{.window = 10, .pulses_per_revolution = 1000, .noise_rpm = 20};
  Standstill standstill;
  EXPECT_FALSE(standstill.moves(look(0ms, 500, 0, false), coarse));
  bool found = false;
  for (int i = 1; i <= 5; ++i)  // 10 r/min
    found |= standstill.moves(look(20ms * i, 500 + 10 * 1000 / 60 * i / 50, 10, false), coarse);
  EXPECT_TRUE(found);
}

TEST(Standstill, WhatGoesOnIsAMotionThoughTheDriveDeniesIt) {
  for (const int rpm : {2, 3, -2, -3}) {
    Standstill standstill;
    EXPECT_FALSE(standstill.moves(look(0ms, 0, 0, false), gauge));
    int rested = 0;
    for (int i = 1; i <= 20 && !standstill.moves(look(10ms * i, 0, rpm, false), gauge); ++i) ++rested;
    EXPECT_EQ(rested, 5) << "by its velocity";
    Standstill slowly_read;
    EXPECT_FALSE(slowly_read.moves(look(0ms, 0, 0, false), gauge));
    EXPECT_TRUE(slowly_read.moves(look(200ms, rpm > 0 ? 6 : -6, rpm, false), gauge)) << "by its way";
  }
}

TEST(Standstill, WithoutTheDrivesWordALittleMoreThanNoiseIsAMotion) {
  Standstill standstill;
  EXPECT_FALSE(standstill.moves(look(0ms, 0, 0, false), gauge));
  EXPECT_TRUE(standstill.moves(look(10ms, 0, 2), gauge)) << "as where a move has begun";
  Standstill told;
  EXPECT_FALSE(told.moves(look(0ms, 0, 0, false), gauge));
  EXPECT_TRUE(told.moves(look(10ms, 0, 2, true), gauge));
}

TEST(Standstill, BelowItTheDrivesOwnWordCountsAtOnce) {
  Standstill standstill;
  EXPECT_TRUE(standstill.moves(look(0ms, 0, 0, true), gauge)) << "its motor turns, slowly";
  EXPECT_FALSE(standstill.moves(look(1ms, 0, 1, false), gauge));
  EXPECT_TRUE(standstill.moves(look(2ms, 0, 300), gauge));
  EXPECT_FALSE(standstill.moves(look(3ms, 5000, -1, false), gauge)) << "its counter was set, too";
}

TEST(Standstill, TheSlowestMotionIsSeenByItsWayBeforeAStartIsGivenUp) {
  Standstill standstill;
  std::optional<Duration> seen;
  int told = 0;
  for (int i = 0; i < 150; ++i) {  // 1 r/min: a pulse in 60 ms
    const auto wavers = noise.at(static_cast<std::size_t>(i) % noise.size());
    const bool moves = standstill.moves(look(20ms * i, i / 3, 1 + wavers / 2), gauge);
    if (moves && !seen) seen = 20ms * i;
    told += moves ? 1 : 0;
  }
  ASSERT_TRUE(seen);
  EXPECT_LT(*seen, 500ms);
  EXPECT_EQ(told, 150 - *seen / 20ms) << "and goes on";
}

TEST(Standstill, WhereTheDriveDoesNotSayItRestsWhenThePositionHasStayedForLongEnough) {
  Standstill standstill;
  EXPECT_TRUE(standstill.moves(look(0ms, 0, 200), gauge));
  EXPECT_TRUE(standstill.moves(look(20ms, 60, 30), gauge));
  Duration rested{};
  for (int i = 2; rested == Duration{} && i < 100; ++i) {
    const auto wavers = noise.at(static_cast<std::size_t>(i) % noise.size());
    if (!standstill.moves(look(20ms * i, 61 + wavers, wavers), gauge)) rested = 20ms * i;
  }
  EXPECT_GE(rested, 500ms);
  EXPECT_LE(rested, 700ms);
  const Standstill::Gauge fine{.window = 10, .pulses_per_revolution = 10'000};
  Standstill other;
  EXPECT_TRUE(other.moves(look(0ms, 0, 200), fine));
  EXPECT_FALSE(other.moves(look(60ms, 1, 1), fine));
}

TEST(Standstill, WhatMayHaveBegunToMoveHasToShowItsRest) {
  Standstill standstill;
  EXPECT_FALSE(standstill.moves(look(0ms, 0, 0), gauge));
  standstill.doubt();
  EXPECT_TRUE(standstill.moves(look(20ms, 1, 1), gauge));
  EXPECT_TRUE(standstill.moves(look(600ms, 2, 1), gauge));
  EXPECT_FALSE(standstill.moves(look(640ms, 2, 1), gauge));
  standstill.doubt();
  EXPECT_FALSE(standstill.moves(look(660ms, 2, 1, false), gauge)) << "the drive's own word counts at once";
}

/// It was in position, by the drive's own word, when its rest was doubted: what is left of its ringing is no
/// motion that has begun.
TEST(Standstill, TheLastOfASettlingLeavesADoubt) {
  Standstill standstill;
  EXPECT_FALSE(standstill.moves(look(0ms, 0, 0, false), gauge));
  standstill.doubt();
  for (int i = 1; i <= 5; ++i) {
    EXPECT_TRUE(standstill.moves(look(10ms * i, i % 2 == 0 ? 3 : -3, 3, false), gauge)) << i;
    EXPECT_TRUE(standstill.doubted()) << i;
  }
  EXPECT_TRUE(standstill.moves(look(60ms, 3, 3, false), gauge));
  EXPECT_FALSE(standstill.doubted()) << "it goes on";
  standstill.doubt();
  EXPECT_TRUE(standstill.moves(look(80ms, 3, 3, false), gauge));
  EXPECT_FALSE(standstill.doubted()) << "it moved before";
}

TEST(Standstill, InDoubtWhatIsFasterOrElsewhereIsAMotion) {
  for (const auto& motion : {look(20ms, 1, 4, false), look(20ms, 6, 3, false), look(20ms, 1, 3, true)}) {
    Standstill standstill;
    EXPECT_FALSE(standstill.moves(look(0ms, 0, 0, false), gauge));
    standstill.doubt();
    EXPECT_TRUE(standstill.moves(motion, gauge));
    EXPECT_FALSE(standstill.doubted());
  }
}

TEST(Standstill, ADoubtLastsUntilSpeedWayOrRestShows) {
  const auto doubted = [](const std::vector<Standstill::Look>& looks) {
    Standstill standstill;
    EXPECT_FALSE(standstill.moves(look(0ms, 0, 0), gauge));
    EXPECT_FALSE(standstill.doubted());
    standstill.doubt();
    for (const auto& one : looks) (void)standstill.moves(one, gauge);
    return standstill.doubted();
  };
  EXPECT_TRUE(doubted({}));
  EXPECT_TRUE(doubted({look(20ms, 1, 1), look(40ms, 0, -1)}));
  EXPECT_FALSE(doubted({look(20ms, 1, 2)})) << "a speed";
  EXPECT_FALSE(doubted({look(20ms, 0, 0), look(40ms, 6, 0)})) << "a way";
  EXPECT_FALSE(doubted({look(20ms, 0, 0, true)})) << "its own word";
  EXPECT_FALSE(doubted({look(20ms, 0, 0), look(640ms, 0, 0)})) << "rest";
}

}  // namespace
}  // namespace axisd::cia402
