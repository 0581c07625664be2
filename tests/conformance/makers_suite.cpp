// The suite once more, with each data sheet of a maker: what its drive can do, by the file.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <ostream>
#include <string>
#include <vector>

#include "tests/conformance/data_sheet.hpp"
#include "tests/conformance/scenario.hpp"

namespace axisd::conformance {

namespace {

#if __has_feature(address_sanitizer)
constexpr bool sampled = true;
#else
constexpr bool sampled = false;
#endif

struct Case {
  std::filesystem::path file;
  const Scenario* scenario;  ///< nullptr: the file is not there
};

void PrintTo(const Case& one, std::ostream* out) {
  *out << one.file.filename().string() << ' ' << (one.scenario == nullptr ? "" : one.scenario->name);
}

std::vector<Case> cases() {
  std::vector<Case> all;
  for (const auto& file : data_sheets()) {
    if (!std::filesystem::exists(file)) {
      all.push_back({file, nullptr});
      continue;
    }
    for (const auto& subject : subjects())
      for (const auto& scenario : subject.scenarios) all.push_back({file, &scenario});
  }
  return all;
}

std::string name_of(const ::testing::TestParamInfo<Case>& info) {
  auto name = info.param.file.filename().string();
  if (info.param.scenario != nullptr) name += fmt::format("_{}", info.param.scenario->name);
  std::ranges::replace_if(name, [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name;
}

/// By hand (docs/any-drive.md): not every file passes all of it.
class DISABLED_MakersDrive : public ::testing::TestWithParam<Case> {};

TEST_P(DISABLED_MakersDrive, Behaves) {
  spdlog::set_level(spdlog::level::off);
  const auto& [file, scenario] = GetParam();
  if (scenario == nullptr)
    GTEST_SKIP() << file << " is not there; name the folder of makers' files in AXISD_EDS_FOLDER";
  const auto manual = manual_of_sheet(file);
  if (const auto* why = manual.skipped(scenario->name)) GTEST_SKIP() << *why;
  for (const bool invert : {false, true}) {
    if (invert && sampled) continue;
    for (const auto& failure : run_scenario(*scenario, manual, {.invert = invert}).failures)
      ADD_FAILURE() << failure;
  }
}

INSTANTIATE_TEST_SUITE_P(Each, DISABLED_MakersDrive, ::testing::ValuesIn(cases()), name_of);

/// A reason that names no scenario would hide nothing, and mean a mistake.
TEST(MakersDrives, AreSkippedForWhatThereIs) {
  std::vector<std::string_view> names;
  for (const auto& subject : subjects())
    for (const auto& scenario : subject.scenarios) names.push_back(scenario.name);
  for (const auto& file : data_sheets()) {
    if (!std::filesystem::exists(file)) continue;
    const auto manual = manual_of_sheet(file);
    for (const auto& name : manual.all_skipped())
      EXPECT_NE(std::ranges::find(names, name), names.end()) << file << ' ' << name;
    EXPECT_EQ(manual.skipped("absolute_moves") != nullptr, manual.skipped("halt") != nullptr) << file;
  }
}

}  // namespace

}  // namespace axisd::conformance
