// The suite: every model of drive_models(), every subject, in parts that ctest runs side by side.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>

#include "devices/simulation/simulator.hpp"
#include "tests/conformance/scenario.hpp"
#include "tests/support/source_tree.hpp"

namespace axisd::conformance {

int& suite_noise() {
  static int counts = Variant{}.noise;
  return counts;
}

namespace {

#if __has_feature(address_sanitizer)
constexpr bool sampled = true;
#else
constexpr bool sampled = false;
#endif

/// Parts that the variants of a varied subject are dealt to.
constexpr int shards = sampled ? 2 : 4;

struct Case {
  std::string model;
  const Subject* subject;
  int shard, of;
  int noise;  ///< of the encoder, counts
};

void PrintTo(const Case& one, std::ostream* out) {
  *out << one.model << ' ' << one.subject->name << ' ' << one.shard + 1 << " of " << one.of << ", noise "
       << one.noise;
}

std::vector<Case> cases() {
  std::vector<Case> all;
  for (const auto& model : models())
    for (const auto& subject : subjects()) {
      const int of = subject.varied ? shards : 1;
      for (int shard = 0; shard < of; ++shard) all.push_back({model, &subject, shard, of, suite_noise()});
    }
  return all;
}

/// What the suite leaves out of 0, 1 and 2 counts, of the models that have an encoder.
std::vector<Case> other_noises() {
  std::vector<Case> all;
  for (const auto& model : models()) {
    if (!Manual(model).says_yes("closed_loop")) continue;
    for (const auto& subject : subjects())
      for (const int noise : {0, 1, 2})
        if (noise != suite_noise()) all.push_back({model, &subject, 0, 1, noise});
  }
  return all;
}

std::string name_of(const ::testing::TestParamInfo<Case>& info) {
  auto name = fmt::format("{}_{}", info.param.model, info.param.subject->name);
  if (info.param.noise != suite_noise()) name += fmt::format("_noise_{}", info.param.noise);
  if (info.param.of > 1) name += fmt::format("_{}", info.param.shard + 1);
  std::ranges::replace_if(name, [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name;
}

/// One line per failure, the same one in many variants once.
void report(const Finding& finding) {
  for (const auto& failure : finding.failures) ADD_FAILURE() << failure;
}

class Suite : public ::testing::TestWithParam<Case> {};

TEST_P(Suite, Behaves) {
  spdlog::set_level(spdlog::level::off);
  const auto& [model, subject, shard, of, noise] = GetParam();
  const Manual manual(model);
  const auto variants = variants_of(model, *subject, sampled || noise != suite_noise(), noise);
  int failed = 0;
  for (std::size_t i = static_cast<std::size_t>(shard); i < variants.size();
       i += static_cast<std::size_t>(of))
    for (const auto& scenario : subject->scenarios) {
      const auto finding = run_scenario(scenario, manual, variants[i]);
      report(finding);
      // A mistake mostly shows in every variant: the first ones tell enough.
      if (!finding.failures.empty() && ++failed >= 8) FAIL() << "further variants are left out";
    }
}

INSTANTIATE_TEST_SUITE_P(Conformance, Suite, ::testing::ValuesIn(cases()), name_of);
INSTANTIATE_TEST_SUITE_P(OtherNoise, Suite, ::testing::ValuesIn(other_noises()), name_of);

TEST(Conformance, EveryModelHasASimulatorAndItsManual) {
  ASSERT_FALSE(models().empty());
  for (const auto& model : models()) {
    EXPECT_NO_THROW(Manual{model});
    EXPECT_NE(simulation::find_simulator(model), nullptr) << model;
  }
}

TEST(Conformance, ThirdsAddUpOnAxesWithoutEnd) {
  spdlog::set_level(spdlog::level::off);
  constexpr int count = 300;
  for (const auto& model : models()) {
    SCOPED_TRACE(model);
    const Manual manual(model);
    for (const bool invert : {false, true})
      EXPECT_NEAR(index_by_thirds({.manual = manual, .variant = {.invert = invert}}, count), count / 3.0,
                  0.05);
  }
}

/// The counter of pulses is what a drive without an encoder shows: it is among them.
TEST(Conformance, RandomMovesDoNotDrift) {
  spdlog::set_level(spdlog::level::off);
  for (const auto& model : models()) {
    SCOPED_TRACE(model);
    const Manual manual(model);
    for (const bool invert : {false, true}) {
      const auto moved = move_at_random({.manual = manual, .variant = {.invert = invert, .noise = 2}}, 250);
      EXPECT_EQ(moved.refused, 0) << moved.first_refusal;
      EXPECT_LE(moved.drift_pulses, 1.001);
    }
  }
}

/// Each switch is flipped in some subject, also in a sampled run, plain and inverted ones among them.
TEST(Conformance, EverySwitchIsFlippedSomewhere) {
  for (const auto& model : models())
    for (const auto& one : simulation::find_simulator(model)->switches) {
      int subjects_with_it = 0;
      for (const auto& subject : subjects())
        subjects_with_it += std::ranges::any_of(
            variants_of(model, subject, sampled),
            [&](const Variant& variant) { return variant.switches.contains(std::string(one.name)); });
      EXPECT_GT(subjects_with_it, 0) << model << ' ' << one.name;
    }
}

#if !__has_feature(address_sanitizer)  // every scenario once more, as the suite runs it
TEST(Conformance, TheReadmeShowsTheMatrix) {
  spdlog::set_level(spdlog::level::off);
  std::vector<std::string> failures;
  const auto matrix = capability_matrix(failures);
  for (const auto& failure : failures) ADD_FAILURE() << failure;
  std::ifstream file(test::in_source_tree("README.md"));
  const std::string readme{std::istreambuf_iterator<char>(file), {}};
  const std::string_view begin = "<!-- capability matrix -->\n",
                         end = "<!-- end of the capability matrix -->";
  const auto from = readme.find(begin), to = readme.find(end);
  ASSERT_TRUE(from != std::string::npos && to != std::string::npos && from < to)
      << "README.md has no " << begin << " ... " << end
      << "; it shows what test_conformance --matrix prints:\n"
      << matrix;
  EXPECT_EQ(readme.substr(from + begin.size(), to - from - begin.size()), matrix)
      << "replace it by what test_conformance --matrix prints";
}
#endif

}  // namespace

}  // namespace axisd::conformance
