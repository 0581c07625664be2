// A flaw of a data sheet is an error where axisd uses what it leaves open, until the configuration says it.
#include "devices/cia402_eds/eds_checks.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "devices/cia402_eds/eds_drive.hpp"
#include "tests/support/source_tree.hpp"

namespace axisd::cia402_eds {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

using Settings = std::map<std::string, SettingValue>;

std::string example() {
  std::ifstream file(test::in_source_tree("config/examples/standard-drive.eds"));
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// The example with a line of one object changed; an empty `to` takes it out.
std::string changed(const std::string& section, const std::string& key, const std::string& to) {
  auto text = example();
  const auto at = text.find("\n[" + section + "]");
  const auto line = text.find("\n" + key + "=", at) + 1;
  EXPECT_NE(at, std::string::npos) << section;
  return text.replace(line, text.find('\n', line) + 1 - line, to.empty() ? "" : to + "\n");
}

struct Judged {
  std::vector<EdsFinding> findings;
  std::vector<std::string> warnings, refused_settings;
};
Judged judge(const std::string& text, const Settings& settings = {}) {
  auto eds = canopen::parse_eds(text);
  EXPECT_TRUE(eds) << eds.error().at(0).message;
  Judged judged;
  if (!eds) return judged;
  const auto overrides = overrides_of(settings);
  judged.refused_settings = apply_overrides(overrides, *eds);
  judged.findings = check_eds(*eds, overrides);
  judged.warnings = warnings_of(*eds, overrides, "drive.eds");
  return judged;
}

struct Used {
  std::string section, key, to;  ///< what is wrong in the file
  std::string name, setting;     ///< the object, and the key that settles it
  SettingValue value;
  std::string settled_by;  ///< as the remedy has it
};

TEST(EdsChecks, AFlawInWhatIsUsedIsAnErrorThatAKeySettles) {
  const std::vector<Used> cases{
      {"6040", "DataType", "DataType=WORD", "6040h:00", "type", "u16", "6040h: { type: TYPE }"},
      {"6041", "AccessType", "AccessType=maybe", "6041h:00", "access", "ro", "6041h: { access: ACCESS }"},
      {"6041", "AccessType", "", "6041h:00", "access", "ro", "6041h: { access: ACCESS }"},
      {"6081", "HighLimit", "HighLimit=0x1FFFFFFFF", "6081h:00", "maximum", std::int64_t{5000},
       "6081h: { maximum: NUMBER }"},
      {"60FF", "LowLimit", "LowLimit=0xFFFFFFFFF", "60FFh:00", "minimum", std::int64_t{-5000},
       "60FFh: { minimum: NUMBER }"},
      {"6084", "AccessType", "AccessType=maybe", "6084h:00", "access", "ro", "6084h: { access: ACCESS }"},
      {"6083", "DefaultValue", "DefaultValue=-1", "6083h:00", "default", std::int64_t{100},
       "6083h: { default: NUMBER }"},
      {"6083", "DefaultValue", "DefaultValue=1\nDefaultValue=2", "6083h:00", "default", std::int64_t{100},
       "6083h: { default: NUMBER }"},
      {"6062", "PDOMapping", "PDOMapping=perhaps", "6062h:00", "pdo", true, "6062h: { pdo: BOOLEAN }"},
      {"6099sub1", "DataType", "DataType=0", "6099h:01", "type", "u32", "6099h:01: { type: TYPE }"},
      {"1018sub2", "DefaultValue", "DefaultValue=4x0", "1018h:02", "default", std::int64_t{7},
       "1018h:02: { default: NUMBER }"},
      {"6502", "DefaultValue", "DefaultValue=none", "6502h:00", "default", std::int64_t{37},
       "6502h: { default: NUMBER }"},
      {"60FD", "DataType", "", "60FDh:00", "access", "none", "60FDh: { type: TYPE }"},
  };
  for (const auto& one : cases) {
    SCOPED_TRACE(one.section + " " + one.key + " -> " + one.to);
    const auto text = changed(one.section, one.key, one.to);
    const auto judged = judge(text);
    ASSERT_THAT(judged.findings, SizeIs(1));
    EXPECT_GT(judged.findings[0].line, 0);
    EXPECT_THAT(judged.findings[0].message, HasSubstr(", and axisd uses object " + one.name));
    EXPECT_EQ(judged.findings[0].settled_by, one.settled_by);
    EXPECT_THAT(judged.warnings, IsEmpty());
    const auto settled = judge(text, {{"objects." + one.name + "." + one.setting, one.value}});
    EXPECT_THAT(settled.refused_settings, IsEmpty());
    EXPECT_THAT(settled.findings, IsEmpty());
    EXPECT_THAT(settled.warnings, IsEmpty());
  }
}

TEST(EdsChecks, AFlawInWhatIsNotUsedIsAWarning) {
  const std::vector<std::array<std::string, 3>> cases{
      {"1000", "DefaultValue", "DefaultValue=many"},  // not used at all
      {"6064", "DefaultValue", "DefaultValue=x"},     // it is only read
      {"6040", "PDOMapping", "PDOMapping=perhaps"},   // the drive itself tells
      {"6081", "ParameterName", ""},                  // a name only
      {"6085", "DataType", "DataType=WORD"},
      {"1008", "AccessType", "AccessType=maybe"},
  };
  for (const auto& [section, key, to] : cases) {
    SCOPED_TRACE(fmt::format("{} {} -> {}", section, key, to));
    const auto judged = judge(changed(section, key, to));
    EXPECT_THAT(judged.findings, IsEmpty());
    ASSERT_THAT(judged.warnings, SizeIs(1));
    EXPECT_THAT(judged.warnings[0], ::testing::MatchesRegex("drive.eds:[0-9]+: .*"));
  }
}

TEST(EdsChecks, AFlawOfTheTargetVelocityDoesNotMatterWithoutVelocityMode) {
  const auto text = changed("60FF", "LowLimit", "LowLimit=0xFFFFFFFFF");
  EXPECT_THAT(judge(text).findings, SizeIs(1));
  const auto judged = judge(text, {{"objects.6502h:00.default", std::int64_t{0x21}}});
  EXPECT_THAT(judged.findings, IsEmpty());
  ASSERT_THAT(judged.warnings, SizeIs(1));
  EXPECT_THAT(judged.warnings[0], HasSubstr("lowlimit"));
}

TEST(EdsChecks, FewWarningsAreShown) {
  auto text = example();
  for (int i = 0; i < 40; ++i) text += "nothing\n";
  const auto judged = judge(text);
  ASSERT_THAT(judged.warnings, SizeIs(11));
  EXPECT_EQ(judged.warnings.back(), "drive.eds: 30 more lines are wrong, in what axisd does not use");
}

TEST(EdsChecks, TheRemedyNamesKeysAndNeverTheFile) {
  const auto of = [](const std::string& text) { return remedy_of(judge(text).findings); };
  EXPECT_EQ(of(changed("6081", "HighLimit", "HighLimit=x")),
            "say what the drive's manual says: drive: { objects: { 6081h: { maximum: NUMBER } } }");
  EXPECT_THAT(
      of(changed("6083", "AccessType", "AccessType=ro")),
      AllOf(HasSubstr("profile position mode"), HasSubstr("drive: { objects: { 6083h: { access: rw } } }")));
  EXPECT_THAT(of(changed("6502", "DefaultValue", "DefaultValue=4")), HasSubstr("6502h: { default: NUMBER }"));
  EXPECT_THAT(of("[1000]\nParameterName=a\nDataType=7\nAccessType=ro\n"), Not(HasSubstr("correct")));
}

TEST(EdsChecks, NoModeHasToBePermittedWhereNothingElseIsNeutral) {
  const auto text = changed("6060", "LowLimit", "LowLimit=1");
  EXPECT_THAT(judge(text).findings, IsEmpty()) << "it has velocity mode";
  Settings settings{{"objects.60FFh:00.access", "none"}};
  EXPECT_THAT(judge(text, settings).findings, IsEmpty()) << "and homing mode";
  settings["objects.6098h:00.access"] = "none";
  EXPECT_THAT(judge(example(), settings).findings, IsEmpty());
  const auto judged = judge(text, settings);
  ASSERT_THAT(judged.findings, SizeIs(1));
  EXPECT_THAT(judged.findings[0].message, HasSubstr("object 6060h:00 cannot be 0"));
  EXPECT_EQ(judged.findings[0].settled_by, "6060h: { minimum: NUMBER }");
  settings["objects.6060h:00.minimum"] = std::int64_t{0};
  EXPECT_THAT(judge(text, settings).findings, IsEmpty());
}

TEST(EdsChecks, WhatTheFileLacksCanBeSaid) {
  auto text = example();
  const auto at = text.find("\n[6083]");
  text.replace(at, 7, "\n[Unused]");
  EXPECT_EQ(judge(text).findings.at(0).settled_by, "6083h: { type: u32, access: rw }");
  EXPECT_THAT(judge(text, {{"objects.6083h:00.type", "u32"}}).refused_settings, SizeIs(1));
  const Settings settings{{"objects.6083h:00.type", "u32"}, {"objects.6083h:00.access", "rw"}};
  EXPECT_THAT(judge(text, settings).findings, IsEmpty());
}

TEST(EdsChecks, AnotherTypeKeepsTheLimitsThatItCanHold) {
  auto eds = canopen::parse_eds(example());
  ASSERT_TRUE(eds);
  EXPECT_THAT(apply_overrides(overrides_of({{"objects.6081h:00.type", "u16"}}), *eds), IsEmpty());
  EXPECT_FALSE(eds->find({0x6081, 0})->high) << "2'000'000";
  EXPECT_TRUE(eds->find({0x6081, 0})->initial) << "10'000";
}

TEST(EdsChecks, SettingsOfOtherKindsAreLeftAlone) {
  EXPECT_THAT(overrides_of({{"eds", "objects.eds"}, {"objects.6081", "x"}, {"objects.xyzuh:00.type", "u8"}}),
              IsEmpty());
}

TEST(EdsChecks, ADcfTellsWhoTheDriveIs) {
  auto text = changed("1018sub2", "DefaultValue", "DefaultValue=1\nParameterValue=0x00402001");
  auto eds = canopen::parse_eds(text);
  ASSERT_TRUE(eds);
  const EdsDrive drive(*find_drive_model("cia402"), *eds, {});
  EXPECT_EQ(drive.model().identity.product, 0x00402001U);
}

/// FFFFFFFFh is the number of nobody: of a sheet that is for several products.
TEST(EdsChecks, ASheetWithoutANumberFitsEveryProduct) {
  for (const auto* number : {"0", "0xFFFFFFFF"}) {
    auto eds =
        canopen::parse_eds(changed("1018sub2", "DefaultValue", fmt::format("DefaultValue={}", number)));
    ASSERT_TRUE(eds);
    eds->product = 0xFFFFFFFF;
    const EdsDrive drive(*find_drive_model("cia402"), *eds, {});
    EXPECT_EQ(drive.model().identity.product, std::nullopt) << number;
    EXPECT_NE(drive.model().identity.vendor, std::nullopt);
  }
}

TEST(EdsChecks, TheFileIsNamedInErrorsAndWarnings) {
  const auto path =
      std::filesystem::path(::testing::TempDir()) / fmt::format("axisd-checks-{}.eds", getpid());
  const auto* model = find_drive_model("cia402");
  const auto specialised = [&](const std::string& text, Settings settings = {}) {
    std::ofstream(path, std::ios::binary) << text;
    settings["eds"] = path.string();
    settings["velocity_unit"] = std::string("pulses_per_second");
    return model->specialise(*model, settings);
  };
  const auto flawed = specialised(changed("6081", "HighLimit", "HighLimit=x"));
  ASSERT_FALSE(flawed);
  EXPECT_THAT(flawed.error().message, ::testing::StartsWith(path.string() + ":"));
  const auto settled = specialised(changed("6081", "HighLimit", "HighLimit=x"),
                                   {{"objects.6081h:00.maximum", std::int64_t{9000}}});
  ASSERT_TRUE(settled) << to_string(settled.error());
  EXPECT_EQ(find_parameter((*settled)->parameters, 0x608100)->maximum, 9000);
  EXPECT_TRUE((*settled)->warnings.empty());
  const auto harmless = specialised(changed("1000", "DefaultValue", "DefaultValue=x"));
  ASSERT_TRUE(harmless) << to_string(harmless.error());
  ASSERT_THAT((*harmless)->warnings, SizeIs(1));
  EXPECT_THAT((*harmless)->warnings[0], ::testing::StartsWith(path.string() + ":"));
  const auto wrong = specialised(example(), {{"objects.6060h:00.maximum", std::int64_t{300}}});
  ASSERT_FALSE(wrong);
  EXPECT_THAT(wrong.error().remedy, HasSubstr("drive: { objects: ... }"));
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace axisd::cia402_eds
