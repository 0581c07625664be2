#include "devices/canary.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>

namespace axisd {
namespace {

using Block = std::array<std::uint16_t, 3>;

constexpr Block factory = {5, 100, 60}, first = {5, 120, 300}, second = {5, 150, 300};
constexpr std::size_t ramp = 1;

TEST(Canary, NothingIsExpectedUntilItWasWritten) {
  Canary<Block> canary(factory);
  EXPECT_TRUE(canary.blocks().empty());
  EXPECT_FALSE(canary.is_expected(factory));
  canary.written(first);
  EXPECT_TRUE(canary.is_known());
  EXPECT_TRUE(canary.is(first));
  EXPECT_FALSE(canary.is_expected(second));
}

TEST(Canary, WithoutAReplyEitherContentMayStandThere) {
  Canary<Block> canary(factory);
  canary.written(first);
  canary.may_hold(second);
  EXPECT_FALSE(canary.is_known());
  EXPECT_FALSE(canary.is(first));
  EXPECT_TRUE(canary.is_expected(first));
  EXPECT_TRUE(canary.is_expected(second));
  canary.found(second);
  EXPECT_TRUE(canary.is(second));
  EXPECT_FALSE(canary.is_expected(first));
}

TEST(Canary, AForgottenOneIsExpectedNoMore) {
  Canary<Block> canary(factory);
  canary.expect({first, second});
  EXPECT_TRUE(canary.is_expected(first));
  canary.distrust(first);
  EXPECT_TRUE(canary.is(second));
  canary.forget();
  EXPECT_FALSE(canary.is_expected(second));
}

TEST(Canary, NoBlockIsLikeOneThatAPowerUpLeaves) {
  Canary<Block> canary(factory);
  EXPECT_EQ(canary.distinct(first, ramp), first);
  EXPECT_EQ(canary.distinct(factory, ramp), (Block{5, 101, 60}));
  canary.note_power_up({5, 101, 60});
  EXPECT_EQ(canary.distinct(factory, ramp), (Block{5, 102, 60}));
}

TEST(Canary, ALongTimeGetsShorter) {
  Canary<Block> canary({5, 2000, 60});
  EXPECT_EQ(canary.distinct({5, 2000, 60}, ramp), (Block{5, 1999, 60}));
}

TEST(Canary, ThereIsAlwaysAnother) {
  Canary<Block> canary({5, 2000, 60});
  canary.note_power_up({5, 1999, 60});
  canary.note_power_up({5, 1998, 60});
  EXPECT_EQ(canary.distinct({5, 1999, 60}, ramp), (Block{5, 1997, 60}));
}

TEST(Canary, OfPowerUpsTheFactorysAndTheNewestAreKept) {
  Canary<Block> canary(factory);
  for (std::uint16_t i = 1; i <= 20; ++i) canary.note_power_up({i, 100, 60});
  canary.note_power_up(factory);
  EXPECT_EQ(canary.power_up_blocks().size(), 8U);
  EXPECT_TRUE(canary.is_left_by_power_up(factory));
  EXPECT_TRUE(canary.is_left_by_power_up({20, 100, 60}));
  EXPECT_FALSE(canary.is_left_by_power_up({1, 100, 60}));
}

}  // namespace
}  // namespace axisd
