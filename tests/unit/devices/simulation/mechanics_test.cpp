#include "devices/simulation/mechanics.hpp"

#include <gtest/gtest.h>

namespace axisd::simulation {
namespace {

constexpr auto home = SwitchKind::home;

TEST(Mechanics, HasOneHomeSwitchOnALinearAxis) {
  const Mechanics linear{.home_switch_from = 100, .home_switch_to = 110};
  EXPECT_TRUE(switch_active(linear, home, 110));
  EXPECT_FALSE(switch_active(linear, home, 111));
  EXPECT_FALSE(switch_active(linear, home, 1100));
  EXPECT_EQ(next_switch(linear, 0, 1), 100);
  EXPECT_EQ(next_switch(linear, 100, 1), 111);
  EXPECT_EQ(next_switch(linear, 111, 1), std::nullopt);
  EXPECT_EQ(next_switch(linear, 111, -1), 110);
}

TEST(Mechanics, MeetsTheHomeSwitchOncePerTurn) {
  const Mechanics rotary{.home_switch_from = 100, .home_switch_to = 110, .turn = 1000.0};
  for (const std::int64_t turn : {-3, 0, 1, 7'000'000}) {
    const auto begin = 1000 * turn;
    EXPECT_FALSE(switch_active(rotary, home, begin + 99));
    EXPECT_TRUE(switch_active(rotary, home, begin + 100));
    EXPECT_TRUE(switch_active(rotary, home, begin + 110));
    EXPECT_FALSE(switch_active(rotary, home, begin + 111));
    EXPECT_EQ(next_switch(rotary, begin + 50, 1), begin + 100);
    EXPECT_EQ(next_switch(rotary, begin + 100, 1), begin + 111);
    EXPECT_EQ(next_switch(rotary, begin + 111, 1), begin + 1100);
    EXPECT_EQ(next_switch(rotary, begin + 111, -1), begin + 110);
    EXPECT_EQ(next_switch(rotary, begin + 110, -1), begin + 99);
    EXPECT_EQ(next_switch(rotary, begin + 99, -1), begin - 890);
  }
}

TEST(Mechanics, RoundsEachTurnByItself) {
  const Mechanics thirds{.home_switch_from = 0, .home_switch_to = 5, .turn = 1000.0 / 3};
  EXPECT_TRUE(switch_active(thirds, home, 1'000'000));
  EXPECT_FALSE(switch_active(thirds, home, 999'999));
  EXPECT_EQ(next_switch(thirds, 6, 1), 333);
  EXPECT_EQ(next_switch(thirds, 339, 1), 667);
}

}  // namespace
}  // namespace axisd::simulation
