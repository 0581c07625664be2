#include "devices/yako_rtu/configuration.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "devices/yako_rtu/registers.hpp"

namespace axisd::yako_rtu {
namespace {

std::ptrdiff_t place(const std::vector<RegisterSetting>& all, std::uint16_t address) {
  return std::ranges::find(all, address, &RegisterSetting::address) - all.begin();
}

DriveSetup setup() {
  DriveSetup setup;
  setup.pulses_per_revolution = 10000;
  setup.inputs = {{.terminal = "X0", .function = "home"},
                  {.terminal = "X1", .function = "positive_limit", .active_low = true},
                  {.terminal = "X2", .function = "jog_positive"},
                  {.terminal = "PU", .function = "quick_stop"}};
  setup.outputs = {{.terminal = "Y1", .function = "brake"}};
  return setup;
}

TEST(Configuration, OrderOfWrites) {
  const auto all = required_registers(setup());
  ASSERT_TRUE(all);
  EXPECT_EQ(place(*all, reg::eeprom_update), 0);
  EXPECT_EQ(place(*all, reg::input_levels), 1);
  for (const std::uint16_t limit_or_stop : {0x0044, 0x0041})
    for (const std::uint16_t later : {0x0018, 0x0011, 0x0043, 0x0045, 0x004D})
      EXPECT_LT(place(*all, limit_or_stop), place(*all, later));
}

TEST(Configuration, EveryInputIsSetAndOnlyNamedOutputs) {
  const auto all = required_registers(setup());
  ASSERT_TRUE(all);
  for (std::uint16_t i = 0; i < input_count; ++i)
    EXPECT_LT(place(*all, static_cast<std::uint16_t>(reg::first_input_function + i)), std::ssize(*all));
  EXPECT_EQ((*all)[static_cast<std::size_t>(place(*all, 0x004A))].value, 0);
  EXPECT_EQ((*all)[static_cast<std::size_t>(place(*all, 0x004D))].value, 2);
  EXPECT_EQ(place(*all, 0x004C), std::ssize(*all)) << "one that is not named may hold a brake";
}

TEST(Configuration, LevelsAndCodes) {
  const auto all = required_registers(setup());
  ASSERT_TRUE(all);
  const auto value = [&](std::uint16_t address) {
    return (*all)[static_cast<std::size_t>(place(*all, address))].value;
  };
  EXPECT_EQ(value(reg::input_levels), 1U << 3U);  // X1 is the fourth, after PU, DR and X0
  EXPECT_EQ(value(reg::microstep), 13);
  EXPECT_EQ(value(reg::eeprom_update), 1);
  EXPECT_EQ(value(0x0045), 12);
  const auto& jog = (*all)[static_cast<std::size_t>(place(*all, 0x0045))];
  EXPECT_TRUE(jog.starts_motion);
  EXPECT_EQ(jog.input_bit, 1U << 4U);
  auto kept = setup();
  kept.persist = true;
  EXPECT_EQ(required_registers(kept)->front().value, 0);
}

TEST(Configuration, WhatTheDriveLacksIsRefused) {
  auto microstep = setup();
  microstep.pulses_per_revolution = 51200;  // of the other families
  EXPECT_EQ(required_registers(microstep).error().reason, Reason::misconfigured);
  auto terminal = setup();
  terminal.inputs[0].terminal = "X8";
  EXPECT_FALSE(required_registers(terminal));
  auto function = setup();
  function.outputs[0].function = "home";
  EXPECT_FALSE(required_registers(function));
}

TEST(Configuration, FunctionsThatCanStartMotion) {
  for (std::uint16_t code = 0; code <= 20; ++code) {
    const bool expected = code == 6 || code == 7 || (code >= 10 && code <= 15);
    EXPECT_EQ(starts_motion(code), expected) << code;
  }
  EXPECT_FALSE(starts_motion(99));
}

}  // namespace
}  // namespace axisd::yako_rtu
