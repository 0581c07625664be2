// What a status word of CiA 402 says of rest, mode by mode.
#include <gtest/gtest.h>

#include <optional>

#include "devices/cia402/encoding.hpp"

namespace axisd::cia402 {
namespace {

constexpr std::uint16_t operates = 0x0027, reached = 0x0400, bit_12 = 0x1000;

std::optional<bool> told(std::int64_t mode, std::uint16_t word, bool halted = false) {
  return told_motion(Model{}, {{object::status_word.key(), word}, {object::mode_display.key(), mode}},
                     halted);
}

TEST(ToldMotion, TargetReachedIsRestWhereThereIsATarget) {
  for (const int mode : {1, 6}) {  // in homing mode: interrupted, not begun, attained or failed
    EXPECT_EQ(told(mode, operates | reached), false) << mode;
    EXPECT_EQ(told(mode, operates), std::nullopt) << mode;
    EXPECT_EQ(told(mode, operates | bit_12), std::nullopt) << mode;
    EXPECT_EQ(told(mode, operates | reached, true), false) << mode;
  }
}

TEST(ToldMotion, AReachedVelocityIsNoRest) {
  EXPECT_EQ(told(3, operates | reached), std::nullopt);
  EXPECT_EQ(told(3, operates | bit_12), false) << "the speed is 0";
  EXPECT_EQ(told(3, operates | reached, true), std::nullopt) << "bit 12 is there for it";
}

/// CiA 402 sets bit 10 when the mode was changed, and when a halt has ended a motion.
TEST(ToldMotion, InNoModeTargetReachedIsRestUnderHaltAlone) {
  EXPECT_EQ(told(0, operates | reached), std::nullopt);
  EXPECT_EQ(told(0, operates, true), std::nullopt);
  EXPECT_EQ(told(0, operates | reached, true), false);
}

TEST(ToldMotion, OtherModesTellNothing) {
  for (const int mode : {-1, 2, 4, 7, 8})
    EXPECT_EQ(told(mode, operates | reached | bit_12, true), std::nullopt) << mode;
}

TEST(ToldMotion, WithoutPowerNothingDrivesTheShaft) {
  for (const std::uint16_t word : {0x0040, 0x0021, 0x0008}) EXPECT_EQ(told(1, word), false) << word;
}

TEST(ToldMotion, TheMakersBitSaysBoth) {
  Model model{};
  model.status.moving = 0x4000;
  for (const int mode : {0, 1, 3, 6})
    for (const bool moves : {false, true}) {
      const auto word = static_cast<std::uint16_t>(operates | reached | bit_12 | (moves ? 0x4000 : 0));
      EXPECT_EQ(
          told_motion(model, {{object::status_word.key(), word}, {object::mode_display.key(), mode}}, false),
          moves)
          << mode;
    }
}

}  // namespace
}  // namespace axisd::cia402
