// What a DriveSetup makes of the YSS-C's objects, and in which order (M3).
#include "devices/cia402/configuration.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "devices/yss_c/model.hpp"
#include "devices/yss_c/objects.hpp"

namespace axisd::cia402 {
namespace {

namespace object = yss_c::object;
using canopen::Object;

const Model& model() { return yss_c::model(); }

Object input_function(std::size_t number) { return {0x2030, static_cast<std::uint8_t>(0x02 + number)}; }
Object output_function(std::size_t number) { return {0x2030, static_cast<std::uint8_t>(0x0D + number)}; }

DriveSetup setup() {
  DriveSetup setup;
  setup.pulses_per_revolution = 4000;
  setup.inputs = {{.terminal = "X0", .function = "home"},
                  {.terminal = "X1", .function = "positive_limit", .active_low = true},
                  {.terminal = "X2", .function = "jog_positive"},
                  {.terminal = "X6", .function = "quick_stop"}};
  setup.outputs = {{.terminal = "Y1", .function = "in_position", .active_low = true}};
  setup.model_settings = {{"overtravel_stop", SettingValue(std::string("quick_stop"))},
                          {"loop_mode", SettingValue(std::string("open"))},
                          {"home_approach", SettingValue(std::string("forward"))},
                          {"lock_current_percent", SettingValue(std::int64_t{25})}};
  return setup;
}

std::vector<DriveSetting> required(const DriveSetup& setup) {
  auto all = required_objects(model(), setup);
  EXPECT_TRUE(all) << all.error().message;
  return all ? *all : std::vector<DriveSetting>();
}

std::ptrdiff_t place(const std::vector<DriveSetting>& all, Object object) {
  return std::ranges::find(all, object.key(), &DriveSetting::address) - all.begin();
}

const DriveSetting& at(const std::vector<DriveSetting>& all, Object object) {
  static const DriveSetting none{.key = "none"};
  const auto found = std::ranges::find(all, object.key(), &DriveSetting::address);
  EXPECT_NE(found, all.end()) << to_string(object);
  return found == all.end() ? none : *found;
}

TEST(Cia402Configuration, WritesLevelsThenLimitsAndStopsThenTheRest) {
  const auto all = required(setup());
  EXPECT_EQ(place(all, object::input_levels), 0);
  for (const auto limit_or_stop : {input_function(1), input_function(6)})
    for (const auto later : {object::microstep, object::overtravel_stop, output_function(1),
                             input_function(0), input_function(2), input_function(5)})
      EXPECT_LT(place(all, limit_or_stop), place(all, later)) << to_string(later);
}

TEST(Cia402Configuration, SetsEveryInputAndOnlyNamedOutputs) {
  const auto all = required(setup());
  for (std::size_t i = 0; i < object::input_count; ++i)
    EXPECT_EQ(at(all, input_function(i)).key, "inputs.X" + std::to_string(i));
  EXPECT_EQ(at(all, input_function(4)).value, 0) << "not named: it must start nothing";
  EXPECT_EQ(at(all, output_function(1)).value, 4);
  EXPECT_EQ(place(all, output_function(0)), std::ssize(all)) << "not named: left alone";
  EXPECT_EQ(place(all, output_function(2)), std::ssize(all));
}

TEST(Cia402Configuration, UsesTheYssCsOwnCodes) {
  auto one = setup();
  one.inputs[2].function = "motor_enable";
  one.inputs.push_back({.terminal = "X3", .function = "motor_free"});
  one.inputs.push_back({.terminal = "X4", .function = "alarm_clear"});
  const auto all = required(one);
  EXPECT_EQ(at(all, input_function(2)).value, 4);  // motor_free on the RS-485 models
  EXPECT_EQ(at(all, input_function(3)).value, 5);
  EXPECT_EQ(at(all, input_function(4)).value, 6);
  EXPECT_EQ(at(all, input_function(6)).value, 9);
}

TEST(Cia402Configuration, MarksWhatCanStartMotion) {
  const auto all = required(setup());
  const auto& jog = at(all, input_function(2));
  EXPECT_TRUE(jog.starts_motion);
  EXPECT_EQ(jog.input_bits, 1U << 2U);
  EXPECT_FALSE(at(all, input_function(0)).starts_motion);
  auto energising = setup();
  energising.inputs[2].function = "motor_enable";
  EXPECT_TRUE(at(required(energising), input_function(2)).starts_motion) << "it energises (M3)";
}

TEST(Cia402Configuration, DecidesOnlyTheBitsOfNamedOutputs) {
  const auto all = required(setup());
  EXPECT_EQ(at(all, object::input_levels).value, 1 << 1);
  const auto& levels = at(all, object::output_levels);
  EXPECT_TRUE(levels.holds(0b111));
  EXPECT_FALSE(levels.holds(0b101));
  EXPECT_EQ(levels.applied_to(0b101), 0b111);
  auto without = setup();
  without.outputs.clear();
  const auto others = required(without);
  EXPECT_EQ(place(others, object::output_levels), std::ssize(others));
}

TEST(Cia402Configuration, SetsWhatTheModelTiesToAnObject) {
  const auto all = required(setup());
  EXPECT_EQ(at(all, object::microstep).value, 10) << "4000 pulses/rev: the codes are not in order of size";
  EXPECT_EQ(at(all, object::microstep).key, "scale.microstep");
  EXPECT_EQ(at(all, object::overtravel_stop).value, 1);
  EXPECT_EQ(at(all, object::loop_mode).value, 1);
  EXPECT_EQ(at(all, {0x2044, 0}).value, 25);
  EXPECT_EQ(at(all, {0x2044, 0}).key, "drive.lock_current_percent");
  EXPECT_EQ(place(all, {0x2042, 0}), std::ssize(all)) << "not given: left as the drive has it";
}

TEST(Cia402Configuration, WritesHomingInTheSizesOfTheDictionary) {
  auto homing = setup();
  homing.homing = HomingProfile{.method = HomingMethod::home_negative,
                                .velocity_rpm = 200,
                                .search_velocity_rpm = 20,
                                .acceleration_time = std::chrono::milliseconds(150),
                                .offset_pulses = -300};
  const auto all = required(homing);
  EXPECT_EQ(at(all, object::homing_speed).value, 200);
  EXPECT_EQ(type_of(model(), object::homing_speed).bytes, 4);
  EXPECT_EQ(at(all, object::homing_search_speed).value, 20);
  EXPECT_EQ(at(all, object::homing_time).value, 150);
  EXPECT_EQ(at(all, object::homing_offset).value, -300) << "one signed object";
  EXPECT_EQ(at(all, object::homing_offset).key, "homing.offset");
  EXPECT_EQ(place(all, object::homing_method), std::ssize(all)) << "negotiated before each homing";
  EXPECT_EQ(place(required(setup()), object::homing_speed), std::ssize(required(setup())));
}

/// 7: only objects printed RW/S reach the EEPROM by a write.
TEST(Cia402Configuration, SavesWhatPersistNamesAndTheDriveCanSave) {
  auto kept = setup();
  kept.homing = HomingProfile{};
  for (const auto& setting : required(kept)) EXPECT_FALSE(setting.saved) << setting.key;
  kept.persist.terminals = true;
  for (const auto& setting : required(kept))
    EXPECT_EQ(setting.saved, setting.key.contains("puts")) << setting.key;
  kept.persist = PersistSettings::all();
  for (const auto& setting : required(kept))
    EXPECT_EQ(setting.saved, !setting.key.starts_with("homing.")) << setting.key << ": RW without /S";
}

TEST(Cia402Configuration, RefusesWhatTheDriveLacks) {
  auto microstep = setup();
  microstep.pulses_per_revolution = 200;  // of the YKD2405PR
  EXPECT_EQ(required_objects(model(), microstep).error().reason, Reason::misconfigured);
  auto terminal = setup();
  terminal.inputs[0].terminal = "X7";
  EXPECT_FALSE(required_objects(model(), terminal));
  auto function = setup();
  function.inputs[0].function = "pt_enable";  // of the RS-485 models
  EXPECT_FALSE(required_objects(model(), function));
}

TEST(Cia402Configuration, NeverAssignsWhatMovesOrForgetsBehindOnesBack) {
  for (const auto* unusable : {"restore_factory", "position_start", "speed_start"}) {
    auto one = setup();
    one.inputs[0].function = unusable;
    const auto all = required_objects(model(), one);
    ASSERT_FALSE(all) << unusable;
    EXPECT_TRUE(all.error().message.contains(unusable)) << all.error().message;
  }
}

TEST(Cia402Configuration, KnowsWhichTerminalsAreShownAsZeroWhileActive) {
  auto one = setup();
  EXPECT_EQ(active_low(model(), one).inputs, 0U) << "by default what is active is shown";
  one.model_settings["terminal_states"] = SettingValue(std::string("level"));
  const auto low = active_low(model(), one);
  EXPECT_EQ(low.inputs, 1U << 1U) << "X1";
  EXPECT_EQ(low.outputs, 1U << 1U) << "Y1";
  const Values values{{object::inputs.key(), 0b1000010}, {object::outputs.key(), 0b011}};
  const auto sample = decode_state(model(), 4000, values, low);
  EXPECT_EQ(sample.inputs, 0b1000000U);
  EXPECT_EQ(sample.outputs, 0b001U);
}

}  // namespace
}  // namespace axisd::cia402
