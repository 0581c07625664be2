// The suite once more, with each data sheet of a maker: what its drive can do, by the file.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/conformance/bench.hpp"
#include "tests/conformance/data_sheet.hpp"
#include "tests/conformance/scenario.hpp"

namespace axisd::conformance {

namespace {

#if __has_feature(address_sanitizer)
constexpr bool sampled = true;
#else
constexpr bool sampled = false;
#endif

std::string name_of(const ::testing::TestParamInfo<std::filesystem::path>& info) {
  auto name = info.param.filename().string();
  std::ranges::replace_if(name, [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name;
}

/// The speed table: what was asked for in mm/s, in whichever unit the drive counts, is what its shaft does.
std::string true_speed(const Setup& setup) {
  using namespace std::chrono_literals;
  Bench bench(
      setup,
      {.limits = false, .home_switch = false, .limit_switches = false, .mechanics = false, .homing = ""});
  bench.ready();
  int starts = 0;
  for (const double asked : {50.0, 12.5}) {
    bench.under_way(bench.client.move_by(5000, {.velocity = asked}, v1::WAIT_UNTIL_STARTED), 1s);
    const auto from = bench.shaft().mm;
    bench.pass(1s);
    const auto speed = bench.shaft().mm - from;
    EXPECT_NEAR(speed, asked, asked / 100);
    fmt::print("speed: {} mm/s is {:.3f} mm/s at the shaft\n", asked, speed);
    expect_done(bench.client.stop());
    ++starts;
  }
  bench.finish(starts);
  return "yes";
}
constexpr Scenario speed_table = {"true_speed", "the shaft is as fast as it is told", &true_speed};

class MakersDrive : public ::testing::TestWithParam<std::filesystem::path> {};

TEST_P(MakersDrive, Behaves) {
  spdlog::set_level(spdlog::level::off);
  const auto& file = GetParam();
  if (!std::filesystem::exists(file))
    GTEST_SKIP() << file << " is not there; name the folder of makers' files in AXISD_EDS_FOLDER";
  const auto manual = manual_of_sheet(file);
  for (const auto& subject : subjects())
    for (const auto& scenario : subject.scenarios) {
      if (const auto* why = manual.skipped(scenario.name)) {
        fmt::print("left out: {}: {}\n", scenario.name, *why);
        continue;
      }
      for (const bool invert : {false, true}) {
        if (invert && sampled) continue;
        const Variant variant{.invert = invert, .noise = suite_noise()};
        for (const auto& failure : run_scenario(scenario, manual, variant).failures) ADD_FAILURE() << failure;
      }
    }
}

TEST_P(MakersDrive, IsAsFastAsItIsTold) {
  spdlog::set_level(spdlog::level::off);
  const auto& file = GetParam();
  if (!std::filesystem::exists(file))
    GTEST_SKIP() << file << " is not there; name the folder of makers' files in AXISD_EDS_FOLDER";
  const auto manual = manual_of_sheet(file);
  if (const auto* why = manual.skipped("absolute_moves")) GTEST_SKIP() << *why;
  for (const bool invert : {false, true})
    for (const auto& failure : run_scenario(speed_table, manual, {.invert = invert}).failures)
      ADD_FAILURE() << failure;
}

INSTANTIATE_TEST_SUITE_P(Each, MakersDrive, ::testing::ValuesIn(data_sheets()), name_of);

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
