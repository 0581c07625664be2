// Data sheets as their makers ship them: which are taken, and why the others are not. Few are part of this
// project (tests/data/eds). The others are read from the folder that AXISD_EDS_FOLDER names, else from
// ../shared/eds beside the tree; what is not there is skipped by name.
#include "tests/support/makers_files.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <iostream>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "devices/cia402_eds/eds_drive.hpp"
#include "devices/descriptor.hpp"

namespace axisd::cia402_eds {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;
using ::testing::StartsWith;

struct Row {
  std::string_view file;
  /// Each is in the refusal; none: it is accepted.
  std::vector<std::string_view> refused_for;
  std::size_t warnings = 0;  ///< of an accepted one
  /// Of velocities, as an accepted one tells it; none: the key is required.
  std::string_view unit{};
};

constexpr std::string_view no_control_word = "object 6040h:00 (control word) is missing";

const std::vector<Row>& table() {
  static const std::vector<Row> rows{
      {"cia-402-profile.eds", {}, 1},  // a template; its list of objects has another length than it says
      {"curtis-f.eds", {no_control_word}},
      {"elmo-gold-whistle-v002.dcf", {}},
      {"elmo-simpliq.dcf", {}, 1},  // lists 6406h without describing it
      {"elmo.eds", {}},
      {"emec-drv5-rev09.eds",
       {"object 606Ch:00 (velocity actual value", "object 6081h:00 (profile velocity) is missing"}},
      {"eyou-yiyou-servo-1.4.eds", {}, 2},  // limits of 2023h and 2025h beyond their type
      {"faulhaber-327-3150-1.eds", {}, 2},  // limits of 6061h, which is only read, the wrong way round
      {"faulhaber-605-3150-67-b.eds", {}},
      {"golems-dsp402.eds", {"[60fd] has no DataType, and axisd uses object 60FDh:00"}},
      {"ingenia-eve-net-1.4.2.eds",
       {"object 6081h:00 (profile velocity) is missing",
        "object 6083h:00 (profile acceleration) is missing"}},
      {"maxon-epos-70-10.eds", {}, 3, "rpm"},  // counts of its lists; 608Ch
      {"maxon-epos4.eds", {}, 0, "rpm"},       // 60A9h
      {"nanotec-cl4-e-1-12.eds", {}, 0, "rpm"},
      {"oriental-motor-blvd-krd-v400.eds", {}, 2},  // default and limit of 403Dh beyond their type
      {"pilz-prbt-0-1.dcf", {}},                    // without 60FFh: for positions alone
      {"roboteq-v60.eds", {no_control_word}},
      {"ros2-canopen-fake-slave.eds", {}},
      {"ros2-canopen-robot-control.eds", {}},  // without 6084h
      {"schunk-golems.eds", {no_control_word}},
      {"schunk-lwa4p-0-63.dcf", {"by object 6502h:00 the drive has no profile position mode"}},
      {"schunk-prl120.eds", {}},  // without 60FFh: for positions alone
      {"sevcon-gen4.eds", {no_control_word}},
      {"technosoft-isd860.eds", {}},  // without 6084h
      {"trinamic-tmcc-160.eds", {}},  // 6084h is read-only
      {"trinamic-tmcm-1231.eds", {}},
      {"trinamic-tmcm-1270.eds", {}},
      {"trinamic-tmcm-1636.eds", {}},
      {"zltech-zlac8015d.eds", {"object 6061h:00 (modes of operation display) is missing"}},  // two axes
  };
  return rows;
}

/// 605Dh is missing, or only read: one more warning says what that means for QuickStop.
constexpr std::string_view halt_in_one_way[] = {
    "faulhaber-327-3150-1.eds", "faulhaber-605-3150-67-b.eds", "maxon-epos-70-10.eds",
    "maxon-epos4.eds",          "pilz-prbt-0-1.dcf",           "schunk-prl120.eds",
    "technosoft-isd860.eds",    "trinamic-tmcc-160.eds",       "trinamic-tmcm-1270.eds"};

bool halts_in_one_way(const Row& row) {
  return std::ranges::find(halt_in_one_way, row.file) != std::end(halt_in_one_way);
}

Result<std::shared_ptr<const DriveDescriptor>> made(const std::filesystem::path& path,
                                                    std::string_view unit = {}) {
  const auto* model = find_drive_model("cia402");
  std::map<std::string, SettingValue> settings{{"eds", path.string()}};
  if (!unit.empty()) settings["velocity_unit"] = std::string(unit);
  return model->specialise(*model, settings);
}

cia402::Units units_of(const DriveDescriptor& drive) {
  return static_cast<const EdsDrive&>(drive).model().meaning.units;
}

void expect_clear(const Error& refusal, const std::filesystem::path& path) {
  EXPECT_EQ(refusal.reason, Reason::invalid_argument);
  EXPECT_THAT(refusal.message, StartsWith(path.string() + ":"));
  EXPECT_FALSE(refusal.remedy.empty());
  EXPECT_THAT(refusal.remedy, Not(HasSubstr("correct the file")));
}

void PrintTo(const Row& row, std::ostream* out) { *out << row.file; }

class MakersFile : public ::testing::TestWithParam<Row> {};

TEST_P(MakersFile, IsTakenOrRefusedAsTheTableSays) {
  const auto& row = GetParam();
  const auto path = test::makers_file(row.file);
  if (!std::filesystem::exists(path))
    GTEST_SKIP() << path << " is not there; name the folder of makers' files in AXISD_EDS_FOLDER";
  const auto drive = made(path);
  if (row.refused_for.empty()) {
    const auto with_key = made(path, row.unit.empty() ? "0.1rpm" : row.unit);
    ASSERT_TRUE(with_key) << to_string(with_key.error());
    EXPECT_THAT((*with_key)->warnings, SizeIs(row.warnings + (halts_in_one_way(row) ? 1 : 0)));
    EXPECT_EQ((*with_key)->capabilities.quick_stop_ramp,
              halts_in_one_way(row) ? QuickStopRamp::of_stop : QuickStopRamp::own);
    ASSERT_EQ(drive.has_value(), !row.unit.empty()) << "no unit may be guessed";
    if (drive) {
      EXPECT_EQ(cia402::name_of(units_of(**drive).velocity), row.unit);
      EXPECT_EQ(cia402::name_of(units_of(**drive).acceleration), row.unit);
      return;
    }
    expect_clear(drive.error(), path);
    EXPECT_THAT(drive.error().remedy, HasSubstr("drive: { velocity_unit: UNIT }"));
    EXPECT_EQ(cia402::name_of(units_of(**with_key).velocity), "0.1rpm");
    return;
  }
  ASSERT_FALSE(drive);
  expect_clear(drive.error(), path);
  for (const auto reason : row.refused_for) EXPECT_THAT(drive.error().message, HasSubstr(reason));
  EXPECT_THAT(drive.error().remedy, HasSubstr("drive: { objects: {"));
}

std::string name_of(const ::testing::TestParamInfo<Row>& info) {
  std::string name(info.param.file);
  std::ranges::replace_if(name, [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name;
}
INSTANTIATE_TEST_SUITE_P(Each, MakersFile, ::testing::ValuesIn(table()), name_of);

/// Other tests take what they run with from the list of those that are taken.
TEST(MakersFiles, ThatAreTakenAreListed) {
  std::vector<std::string_view> taken;
  for (const auto& row : table())
    if (row.refused_for.empty()) taken.push_back(row.file);
  EXPECT_THAT(test::accepted_makers_files, ::testing::ElementsAreArray(taken));
}

/// Also those without a row: what is said of them is shown, so that their rows can be written.
TEST(MakersFiles, GetAClearAnswer) {
  std::set<std::string_view> known;
  for (const auto& row : table()) known.insert(row.file);
  int seen = 0;
  for (std::error_code error;
       const auto& entry : std::filesystem::directory_iterator(test::makers_folder(), error)) {
    const auto extension = entry.path().extension();
    if (extension != ".eds" && extension != ".dcf") continue;
    SCOPED_TRACE(entry.path());
    ++seen;
    const auto drive = made(entry.path());
    if (!drive) expect_clear(drive.error(), entry.path());
    if (!known.contains(entry.path().filename().string()))
      std::cout << entry.path().filename() << ": no row; it is "
                << (drive ? "accepted" : "refused: " + to_string(drive.error())) << "\n";
  }
  if (seen == 0)
    GTEST_SKIP() << "no file in " << test::makers_folder()
                 << "; name the folder of makers' files in AXISD_EDS_FOLDER";
}

}  // namespace
}  // namespace axisd::cia402_eds
