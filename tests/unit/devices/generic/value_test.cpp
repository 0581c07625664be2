#include "devices/generic/value.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace axisd {
namespace {

using Words = std::vector<std::uint16_t>;

ValueSettings one(ValueType type, double scale = 1) {
  return {.name = "level", .address = 10, .type = type, .scale = scale, .unit = "mm"};
}

TEST(DeviceValue, TypesAndScales) {
  struct Case {
    ValueType type;
    double scale;
    Words raw;
    double value;
  };
  const Case cases[] = {
      {ValueType::u16, 1, {0xFFFF}, 65535},
      {ValueType::u16, 0.5, {0x0003}, 1.5},
      {ValueType::i16, 1, {0xFFFF}, -1},
      {ValueType::i16, -2, {0x8000}, 65536},
      {ValueType::u32, 1, {0xFFFF, 0xFFFE}, 4294967294.0},
      {ValueType::u32, 1, {0x0001, 0x0002}, 65538},  // high word first
      {ValueType::i32, 1, {0x8000, 0x0000}, -2147483648.0},
      {ValueType::i32, 0.25, {0xFFFF, 0xFFFC}, -1},
      {ValueType::f32, 1, {0x3FC0, 0x0000}, 1.5},
      {ValueType::f32, 10, {0xC000, 0x0000}, -20},
  };
  for (const auto& each : cases) {
    const auto settings = one(each.type, each.scale);
    EXPECT_EQ(decode(settings, from_registers(each.raw)), each.value);
    const auto raw = encode(settings, each.value);
    ASSERT_TRUE(raw) << to_string(raw.error());
    EXPECT_EQ(to_registers(*raw, each.type), each.raw);
  }
}

TEST(DeviceValue, ObjectsMayHaveOneByte) {
  EXPECT_EQ(decode(one(ValueType::u8), 0xFE), 254);
  EXPECT_EQ(decode(one(ValueType::i8, 0.5), 0xFE), -1);
  EXPECT_EQ(*encode(one(ValueType::i8, 0.5), -1), 0xFEU) << "of the other bytes nothing is set";
  EXPECT_EQ(encode(one(ValueType::u8), 256).error().reason, Reason::out_of_range);
  EXPECT_EQ(encode(one(ValueType::i8), -129).error().reason, Reason::out_of_range);
  EXPECT_EQ(byte_count(ValueType::i8), 1);
  EXPECT_EQ(byte_count(ValueType::i16), 2);
  EXPECT_EQ(byte_count(ValueType::f32), 4);
}

TEST(DeviceValue, TheNearestIsWritten) {
  EXPECT_EQ(*encode(one(ValueType::u16, 0.1), 12.34), 123U);
  EXPECT_EQ(*encode(one(ValueType::i16, 0.1), -12.37), 0xFF84U);
  EXPECT_EQ(*encode(one(ValueType::u16), 65535.4), 65535U);
}

TEST(DeviceValue, WhatDoesNotFitIsRefusedWithTheRange) {
  const double nowhere[] = {-1, 65536, 1e300, std::nan(""), std::numeric_limits<double>::infinity()};
  for (const auto value : nowhere) {
    const auto raw = encode(one(ValueType::u16), value);
    ASSERT_FALSE(raw) << value;
    EXPECT_EQ(raw.error().reason, Reason::out_of_range);
    ASSERT_TRUE(raw.error().permitted);
    EXPECT_EQ(raw.error().permitted->maximum, 65535);
    EXPECT_EQ(raw.error().permitted->unit, "mm");
  }
  const auto mirrored = encode(one(ValueType::i16, -0.5), 20000);
  ASSERT_FALSE(mirrored);
  EXPECT_EQ(mirrored.error().permitted->minimum, -16383.5);
  EXPECT_EQ(mirrored.error().permitted->maximum, 16384);
  EXPECT_FALSE(encode(one(ValueType::f32), 1e39));
  EXPECT_FALSE(encode(one(ValueType::i32), 2147483648.0));
}

std::vector<ValueSettings> at(std::initializer_list<std::pair<int, ValueType>> registers) {
  std::vector<ValueSettings> all;
  for (const auto& [address, type] : registers)
    all.push_back({.name = "r", .address = static_cast<std::uint16_t>(address), .type = type});
  return all;
}

TEST(RegisterBlocks, NeighboursAreReadTogetherAndGapsNotBridged) {
  using enum ValueType;
  const auto blocks =
      blocks_of(at({{5, u16}, {1, u32}, {3, i16}, {4, f32}, {8, u16}, {7, u16}, {0xFFFF, u16}}));
  ASSERT_EQ(blocks.size(), 3U);
  EXPECT_EQ(blocks[0].address, 1);
  EXPECT_EQ(blocks[0].count, 5);  // 1..2, 3, 4..5 and 5 once more
  EXPECT_EQ(blocks[0].values, (std::vector<std::size_t>{1, 2, 3, 0}));
  EXPECT_EQ(blocks[1].address, 7);
  EXPECT_EQ(blocks[1].count, 2);
  EXPECT_EQ(blocks[2].address, 0xFFFF);
  EXPECT_EQ(blocks[2].count, 1);
}

TEST(RegisterBlocks, AtMostSixteenAndNoValueTorn) {
  std::vector<ValueSettings> many;
  many.reserve(21);
  for (int i = 0; i < 20; ++i)
    many.push_back({.name = "r",
                    .address = static_cast<std::uint16_t>(1 + 2 * i),
                    .type = i == 0 ? ValueType::u32 : ValueType::i32});
  many.push_back({.name = "odd", .address = 0});
  const auto blocks = blocks_of(many);
  std::size_t values = 0;
  for (const auto& block : blocks) {
    EXPECT_LE(block.count, 16);
    values += block.values.size();
    for (const auto i : block.values) {
      EXPECT_GE(many[i].address, block.address);
      EXPECT_LE(many[i].address + register_count(many[i].type), block.address + block.count);
    }
  }
  EXPECT_EQ(values, many.size());
  EXPECT_EQ(blocks.size(), 3U);
}

}  // namespace
}  // namespace axisd
