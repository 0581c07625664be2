#include "devices/yako_rtu/codec.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace axisd::yako_rtu {
namespace {

using namespace std::chrono_literals;

/// Registers 0x0003..0x000C of a drive at rest, enabled.
std::vector<std::uint16_t> at_rest() { return std::vector<std::uint16_t>(state_count, 0); }

TEST(Codec, Status) {
  auto registers = at_rest();
  EXPECT_TRUE(decode_state(registers).enabled);
  registers[4] = 0x10;  // bit 4 is inverted: 1 is released
  EXPECT_FALSE(decode_state(registers).enabled);
  registers[4] = 0x03;
  EXPECT_TRUE(decode_state(registers).in_position);
  EXPECT_TRUE(decode_state(registers).homed);
}

TEST(Codec, EitherSignOfMotionCounts) {
  auto registers = at_rest();
  EXPECT_FALSE(decode_state(registers).moving);
  registers[1] = 1;
  EXPECT_TRUE(decode_state(registers).moving);
  registers[1] = 0;
  registers[4] = 0x04;
  EXPECT_TRUE(decode_state(registers).moving);
}

TEST(Codec, AnAlarmBitWithoutACodeIsAnAlarm) {
  auto registers = at_rest();
  registers[4] = 0x08;
  EXPECT_NE(decode_state(registers).alarm_code, 0);
  registers[3] = 3;
  EXPECT_EQ(decode_state(registers).alarm_code, 3);
}

TEST(Codec, PositionAndSpeedAreSigned) {
  auto registers = at_rest();
  registers[7] = 0xFFFF;
  registers[8] = 0xFFFE;
  registers[9] = 0xFF9C;
  const auto sample = decode_state(registers);
  EXPECT_EQ(sample.position_pulses, -2);
  EXPECT_EQ(sample.velocity_rpm, -100);
  registers[7] = 0x0001;
  registers[8] = 0x86A0;
  EXPECT_EQ(decode_state(registers).position_pulses, 100'000);
}

/// 6.2.5, the manual's two application examples.
TEST(Codec, TheManualsExamples) {
  EXPECT_EQ(encode(MoveProfile{.target_pulses = 1000,
                               .velocity_rpm = 500,
                               .start_rpm = 10,
                               .acceleration_time = 100ms,
                               .deceleration_time = 100ms}),
            (MotionBlock{0x000A, 0x0064, 0x0064, 0x01F4, 0x0000, 0x03E8}));
  const auto speed = encode(VelocityProfile{
      .velocity_rpm = 500, .start_rpm = 10, .acceleration_time = 100ms, .deceleration_time = 100ms});
  EXPECT_EQ(speed, (MotionBlock{0x000A, 0x0064, 0x0064, 0x01F4, 0, 0}));
}

TEST(Codec, NegativeTargetsAndSpeeds) {
  const auto move = encode(MoveProfile{.target_pulses = -1, .velocity_rpm = 60});
  EXPECT_EQ(move[4], 0xFFFF);
  EXPECT_EQ(move[5], 0xFFFF);
  EXPECT_EQ(encode(VelocityProfile{.velocity_rpm = -60})[3], 0xFFC4);
}

TEST(Codec, HomingOffsetsHaveARegisterForEachDirection) {
  EXPECT_EQ(encode(HomingProfile{.method = HomingMethod::negative_limit,
                                 .velocity_rpm = 120,
                                 .search_velocity_rpm = 60,
                                 .acceleration_time = 200ms,
                                 .offset_pulses = 7}),
            (HomingBlock{3, 120, 60, 200, 7, 0}));
  const auto backwards = encode(HomingProfile{.offset_pulses = -9});
  EXPECT_EQ(backwards[4], 0);
  EXPECT_EQ(backwards[5], 9);
}

TEST(Codec, EachExceptionComesWithARemedy) {
  for (std::uint32_t code = 0; code <= 9; ++code) EXPECT_STRNE(exception_remedy(code), "") << code;
  EXPECT_STREQ(exception_remedy(8), exception_remedy(0)) << "none that the manual has";
  EXPECT_NE(std::string(exception_remedy(7)).find("range"), std::string::npos);
  EXPECT_NE(std::string(exception_remedy(1)).find("shielding"), std::string::npos) << "CRC";
}

}  // namespace
}  // namespace axisd::yako_rtu
