// Which settings a setup means, and their order, for a model that shares no place with any other.
#include "devices/drive_settings.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

namespace axisd {
namespace {

using testing::ElementsAre;

constexpr TerminalSpec inputs[] = {{"I1"}, {"I2"}, {"I3"}}, outputs[] = {{"O1"}, {"O2"}};
constexpr TerminalFunctionSpec input_functions[] = {
    {"none", 0, {}}, {"home", 7, {}}, {"positive_limit", 8, {}}, {"jog_positive", 9, {}, true}};
constexpr TerminalFunctionSpec output_functions[] = {{"none", 0, {}}, {"brake", 3, {}}};
constexpr std::int32_t microsteps[] = {500, 1000};
constexpr std::string_view loop_modes[] = {"closed", "open"};
constexpr SettingSpec settings[] = {{.key = "loop_mode",
                                     .kind = "enum",
                                     .choices = loop_modes,
                                     .default_value = "closed",
                                     .description = "",
                                     .object = 0x700},
                                    {.key = "home_approach",
                                     .kind = "enum",
                                     .choices = loop_modes,
                                     .default_value = "closed",
                                     .description = ""}};
const DriveDescriptor model{.model = "other",
                            .inputs = inputs,
                            .outputs = outputs,
                            .input_functions = input_functions,
                            .output_functions = output_functions,
                            .settings = settings};
const SettingPlaces places{.input_levels = 0x800,
                           .first_input_function = 0x810,
                           .output_levels = 0x820,
                           .first_output_function = 0x830,
                           .microstep = 0x840,
                           .microstep_codes = microsteps};

DriveSetup setup() {
  DriveSetup setup;
  setup.pulses_per_revolution = 1000;
  setup.inputs = {{.terminal = "I1", .function = "jog_positive"},
                  {.terminal = "I3", .function = "positive_limit", .active_low = true}};
  setup.outputs = {{.terminal = "O2", .function = "brake", .active_low = true}};
  setup.model_settings = {{"loop_mode", SettingValue(std::string("open"))},
                          {"home_approach", SettingValue(std::string("open"))}};
  return setup;
}

std::vector<DriveSetting> required(const DriveSetup& setup, const SettingPlaces& where = places) {
  auto all =
      required_settings(model, setup, where, {{.address = 0x900, .value = 60, .key = "homing.velocity"}});
  EXPECT_TRUE(all) << all.error().message;
  return all.value_or(std::vector<DriveSetting>());
}

const DriveSetting& at(const std::vector<DriveSetting>& all, std::uint32_t address) {
  static const DriveSetting none{.key = "none"};
  const auto found = std::ranges::find(all, address, &DriveSetting::address);
  return found == all.end() ? none : *found;
}

TEST(DriveSettings, ComeInTheOrderOfWriting) {
  EXPECT_THAT(addresses_of(required(setup())),
              ElementsAre(0x800, 0x820, 0x812, 0x840, 0x700, 0x900, 0x831, 0x810, 0x811))
      << "levels, the limit, microstep, the model's own, homing, outputs, other inputs";
}

TEST(DriveSettings, HaveTheCodesOfTheModel) {
  const auto all = required(setup());
  EXPECT_EQ(at(all, 0x800).value, 0b100);
  EXPECT_EQ(at(all, 0x812).value, 8);
  EXPECT_EQ(at(all, 0x840).value, 1);
  EXPECT_EQ(at(all, 0x700).value, 1);
  EXPECT_EQ(at(all, 0x831).value, 3);
  EXPECT_EQ(at(all, 0x811).value, 0) << "not named: it must start nothing";
  EXPECT_EQ(at(all, 0x830).key, "none") << "not named: it may hold a brake";
  EXPECT_EQ(at(all, 0x820).applied_to(0b01), 0b11) << "the other output keeps its level";
  EXPECT_TRUE(at(all, 0x820).holds(0b10));
}

TEST(DriveSettings, SayWhatStartsMotion) {
  const auto all = required(setup());
  EXPECT_TRUE(at(all, 0x810).starts_motion);
  EXPECT_EQ(at(all, 0x810).input_bits, 0b001U);
  EXPECT_TRUE(is_input_function(at(all, 0x810)));
  EXPECT_FALSE(at(all, 0x812).starts_motion);
  EXPECT_FALSE(is_input_function(at(all, 0x800)));
}

TEST(DriveSettings, AreSavedAsPersistSays) {
  auto kept = setup();
  for (const auto& setting : required(kept)) EXPECT_FALSE(setting.saved) << setting.key;
  kept.persist.terminals = true;
  for (const auto& setting : required(kept))
    EXPECT_EQ(setting.saved, setting.key.contains("puts")) << setting.key;
  kept.persist = PersistSettings::all();
  for (const auto& setting : required(kept)) EXPECT_TRUE(setting.saved) << setting.key;
}

TEST(DriveSettings, LeaveOutWhatTheModelHasNoPlaceFor) {
  EXPECT_THAT(addresses_of(required(setup(), {})), ElementsAre(0x700, 0x900));
  auto bare = setup();
  bare.outputs.clear();
  EXPECT_EQ(at(required(bare), 0x820).key, "none") << "no output is named";
}

TEST(DriveSettings, AreRefusedWhereTheModelLacksThem) {
  const auto reason = [](const DriveSetup& setup) {
    const auto all = required_settings(model, setup, places, {});
    return all ? std::nullopt : std::optional(all.error().reason);
  };
  auto one = setup();
  one.pulses_per_revolution = 999;
  EXPECT_EQ(reason(one), Reason::misconfigured);
  one = setup();
  one.inputs[0].terminal = "I4";
  EXPECT_EQ(reason(one), Reason::misconfigured);
  one = setup();
  one.outputs[0].function = "home";
  EXPECT_EQ(reason(one), Reason::misconfigured);
}

}  // namespace
}  // namespace axisd
