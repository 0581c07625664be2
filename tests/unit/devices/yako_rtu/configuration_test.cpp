#include "devices/yako_rtu/configuration.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "devices/setup_codes.hpp"
#include "devices/yako_rtu/registers.hpp"

namespace axisd::yako_rtu {
namespace {

constexpr std::uint16_t input_count = 10;

/// What required_registers() needs of the driver's data, for a model by its name.
Model model_of(const char* name, std::uint16_t first_input_function = reg::first_input_function) {
  return {.descriptor = find_drive_model(name), .first_input_function = first_input_function};
}
const Model ykd = model_of("ykd2405pr");

std::ptrdiff_t place(const std::vector<DriveSetting>& all, std::uint16_t address) {
  return std::ranges::find(all, address, &DriveSetting::address) - all.begin();
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
  const auto all = required_registers(ykd, setup());
  ASSERT_TRUE(all);
  EXPECT_EQ(place(*all, reg::input_levels), 0);
  for (const std::uint16_t limit_or_stop : {0x0044, 0x0041})
    for (const std::uint16_t later : {0x0011, 0x0043, 0x0045, 0x004D})
      EXPECT_LT(place(*all, limit_or_stop), place(*all, later));
}

TEST(Configuration, EveryInputIsSetAndOnlyNamedOutputs) {
  const auto all = required_registers(ykd, setup());
  ASSERT_TRUE(all);
  for (std::uint16_t i = 0; i < input_count; ++i)
    EXPECT_LT(place(*all, static_cast<std::uint16_t>(reg::first_input_function + i)), std::ssize(*all));
  EXPECT_EQ((*all)[static_cast<std::size_t>(place(*all, 0x004A))].value, 0);
  EXPECT_EQ((*all)[static_cast<std::size_t>(place(*all, 0x004D))].value, 2);
  EXPECT_EQ(place(*all, 0x004C), std::ssize(*all)) << "one that is not named may hold a brake";
}

TEST(Configuration, LevelsAndCodes) {
  const auto all = required_registers(ykd, setup());
  ASSERT_TRUE(all);
  const auto value = [&](std::uint16_t address) {
    return (*all)[static_cast<std::size_t>(place(*all, address))].value;
  };
  EXPECT_EQ(value(reg::input_levels), 1U << 3U);  // X1 is the fourth, after PU, DR and X0
  EXPECT_EQ(value(reg::microstep), 13);
  EXPECT_EQ(value(0x0045), 12);
  const auto& jog = (*all)[static_cast<std::size_t>(place(*all, 0x0045))];
  EXPECT_TRUE(jog.starts_motion);
  EXPECT_EQ(jog.input_bits, 1U << 4U);
  EXPECT_FALSE(jog.saved);
  auto kept = setup();
  kept.persist.terminals = true;
  const auto saved = required_registers(ykd, kept);
  ASSERT_TRUE(saved);
  for (const auto& setting : *saved) EXPECT_EQ(setting.saved, setting.key.contains("puts")) << setting.key;
}

TEST(Configuration, WhatTheDriveLacksIsRefused) {
  auto microstep = setup();
  microstep.pulses_per_revolution = 51200;  // of the other families
  EXPECT_EQ(required_registers(ykd, microstep).error().reason, Reason::misconfigured);
  auto terminal = setup();
  terminal.inputs[0].terminal = "X8";
  EXPECT_FALSE(required_registers(ykd, terminal));
  auto function = setup();
  function.outputs[0].function = "home";
  EXPECT_FALSE(required_registers(ykd, function));
}

TEST(Configuration, OnlyTheBitsOfNamedOutputsAreDecided) {
  auto low = setup();
  low.outputs[0].active_low = true;
  const auto all = required_registers(ykd, low);
  ASSERT_TRUE(all);
  const auto& levels = (*all)[static_cast<std::size_t>(place(*all, reg::output_levels))];
  EXPECT_TRUE(levels.holds(0b1010));
  EXPECT_FALSE(levels.holds(0b1000));
  EXPECT_EQ(levels.applied_to(0b1000), 0b1010);
}

TEST(Configuration, SettingsWithARegister) {
  auto set = setup();
  set.model_settings = {{"current", SettingValue(std::string("2.7A"))},
                        {"input_filter_x2_x3", SettingValue(std::int64_t{25})},
                        {"model_code", SettingValue(std::int64_t{0x0302})}};
  const auto all = required_registers(ykd, set);
  ASSERT_TRUE(all);
  EXPECT_EQ((*all)[static_cast<std::size_t>(place(*all, reg::current))].value, 7);
  EXPECT_EQ((*all)[static_cast<std::size_t>(place(*all, 0x0117))].value, 25);
  EXPECT_EQ((*all)[static_cast<std::size_t>(place(*all, 0x0117))].key, "drive.input_filter_x2_x3");
  EXPECT_EQ(place(*all, reg::model), std::ssize(*all)) << "that one has no register to write";
}

TEST(Configuration, TheOtherReadingOfTheTerminalRegisters) {
  auto ssd = model_of("ssd2608pr");
  ssd.first_input_function_of_wiring = 0x0043;
  DriveSetup setup{.pulses_per_revolution = 51200, .inputs = {{.terminal = "X4", .function = "home"}}};
  EXPECT_EQ(first_input_function(ssd, setup), 0x0041);
  setup.model_settings["terminal_registers"] = SettingValue(std::string("wiring"));
  EXPECT_EQ(first_input_function(ssd, setup), 0x0043);
  const auto all = required_registers(ssd, setup);
  ASSERT_TRUE(all);
  EXPECT_EQ((*all)[static_cast<std::size_t>(place(*all, 0x0047))].value, 1);
  EXPECT_EQ(place(*all, 0x0041), std::ssize(*all));
}

TEST(Configuration, SegmentsAreOwnedWholeButForTimesThatCannotBeWrittenBack) {
  auto set = setup();
  DriveSegments table{.absolute = true, .rows = std::vector<DriveSegments::Row>(5)};
  table.rows[2] = {
      .pulses = -100'000, .velocity_rpm = 300, .acceleration_time = std::chrono::milliseconds(50)};
  table.rows[4] = {.acceleration_time = std::chrono::milliseconds(80), .pv_velocity_rpm = 60};
  set.segments = table;
  set.inputs.push_back({.terminal = "X7", .function = "pt_enable"});
  const auto all = required_registers(ykd, set);
  ASSERT_TRUE(all);
  const auto at = [&](std::uint16_t address) {
    return (*all)[static_cast<std::size_t>(place(*all, address))];
  };
  EXPECT_EQ(at(reg::terminal_move_mode).value, 1);
  EXPECT_EQ(at(0x0092).value, 0xFFFE);
  EXPECT_EQ(at(0x00A2).value, 0x7960);
  EXPECT_EQ(at(0x00B2).value, 300);
  EXPECT_EQ(at(0x00C2).value, 50);
  EXPECT_EQ(at(0x00C4).value, 80);
  EXPECT_EQ(at(0x00E4).value, 60);
  EXPECT_EQ(at(0x00B0).value, 0);
  EXPECT_TRUE(at(0x00B0).starts_motion);
  EXPECT_EQ(at(0x00B0).input_bits, 1U << 9U);
  EXPECT_EQ(place(*all, 0x00C0), std::ssize(*all));
}

TEST(Configuration, ARowThatChangesIsSilencedFirst) {
  DriveSegments table{.rows = std::vector<DriveSegments::Row>(3)};
  table.rows[2] = {.pulses = 1000, .velocity_rpm = 300, .acceleration_time = std::chrono::milliseconds(50)};
  const auto wanted = segment_registers(table, 0b100, true);
  SettingValues present;
  for (const auto& setting : wanted) present[setting.address] = setting.value;
  EXPECT_TRUE(silenced_segments(wanted, present, 0b100, true).empty()) << "nothing changes";
  present[0x00A2] = 999;
  const auto silenced = silenced_segments(wanted, present, 0b100, true);
  ASSERT_EQ(silenced.size(), 1U) << "its PV speed is 0 as it is";
  EXPECT_EQ(silenced[0].address, 0x00B2U);
  EXPECT_EQ(silenced[0].value, 0);
  EXPECT_EQ(silenced[0].input_bits, 0b100U);
  EXPECT_TRUE(silenced[0].saved && silenced[0].starts_motion);
  present[reg::terminal_move_mode] = 1;
  present[0x00E4] = 60;
  EXPECT_EQ(silenced_segments(wanted, present, 0b100, true).size(), 2U) << "another mode is for all rows";
}

TEST(Configuration, FunctionsThatCanStartMotion) {
  for (std::uint16_t code = 0; code <= 20; ++code) {
    const bool expected = code == 6 || (code >= 10 && code <= 15);
    EXPECT_EQ(starts_motion(ykd.descriptor->input_functions, code), expected) << code;
  }
  EXPECT_FALSE(starts_motion(ykd.descriptor->input_functions, 99));
}

}  // namespace
}  // namespace axisd::yako_rtu
