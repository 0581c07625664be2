#include "tests/conformance/real/vcan_suite.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/conformance/data_sheet.hpp"
#include "tests/conformance/scenario.hpp"

namespace axisd::conformance {

namespace {

struct Job {
  const Scenario* scenario;
  const Manual* manual;
  Variant variant;
};

/// What each data sheet of a maker is run with in a sample.
constexpr std::string_view of_each_make[] = {"enable_and_disable", "absolute_moves", "velocity_moves",
                                             "quick_stop", "all_methods"};

/// Each of them takes as long as twenty others.
constexpr std::string_view long_ones[] = {"every_alarm", "thousand_moves"};

bool is_long(const Job& job) {
  return std::ranges::find(long_ones, job.scenario->name) != std::end(long_ones);
}

/// Drives of makers, of those data sheets that are there.
std::vector<Manual> makes() {
  std::vector<Manual> manuals;
  for (const auto& file : data_sheets())
    if (std::filesystem::exists(file)) manuals.push_back(manual_of_sheet(file));
  return manuals;
}

std::vector<Manual> manuals_on_can() {
  std::vector<Manual> manuals;
  for (const auto& model : models())
    if (Manual manual(model); manual.bus() == "canopen") manuals.push_back(std::move(manual));
  return manuals;
}

/// Motion also inverted; what runs the same driver from a data sheet is plain.
std::vector<Job> all_jobs(const std::vector<Manual>& manuals, std::string_view named) {
  std::vector<Job> all;
  for (const auto& manual : manuals)
    for (const auto& subject : subjects())
      for (const auto& scenario : subject.scenarios) {
        const bool left_out = manual.lacks(scenario.name) || manual.skipped(scenario.name) != nullptr;
        const auto name = fmt::format("{} {}", manual.name(), scenario.name);
        if (left_out || name.find(named) == std::string::npos) continue;
        all.push_back({.scenario = &scenario, .manual = &manual, .variant = {}});
        if (subject.name == "motion" && !manual.has("data_sheet"))
          all.push_back({.scenario = &scenario, .manual = &manual, .variant = {.invert = true}});
      }
  return all;
}

/// Long ones come first, so that guests side by side have one each.
std::vector<Job> sample_of_jobs(const std::vector<Manual>& manuals, const std::vector<Manual>& makes) {
  std::vector<Job> sample, short_ones;
  std::size_t turn = 0;
  for (const auto& subject : subjects())
    for (const auto& scenario : subject.scenarios) {
      std::vector<Job> able;
      for (const auto& manual : manuals)
        if (!manual.lacks(scenario.name))
          able.push_back({.scenario = &scenario, .manual = &manual, .variant = {}});
      if (able.empty()) continue;
      if (is_long(able.front()))
        sample.push_back(able[turn++ % able.size()]);
      else if (subject.name == "motion" || subject.name == "stop")
        short_ones.insert(short_ones.end(), able.begin(), able.end());
      else
        short_ones.push_back(able[turn++ % able.size()]);
    }
  sample.insert(sample.end(), short_ones.begin(), short_ones.end());
  for (const auto& make : makes)
    for (const auto& subject : subjects())
      for (const auto& scenario : subject.scenarios)
        if (std::ranges::find(of_each_make, scenario.name) != std::end(of_each_make) &&
            make.skipped(scenario.name) == nullptr)
          sample.push_back({.scenario = &scenario, .manual = &make, .variant = {}});
  return sample;
}

bool run(const Job& job, const Programs& programs) {
  const auto begin = monotonic_now();
  const auto make_target = [&](const Plant& plant) { return make_process_target(programs, "vcan0", plant); };
  const auto finding = run_scenario(*job.scenario, *job.manual, job.variant, make_target, true);
  const auto took = std::chrono::duration<double>(monotonic_now() - begin).count();
  const bool passed = finding.failures.empty();
  fmt::print("{} {} {} {} ({:.1f} s)\n", passed ? "passed" : "FAILED", job.manual->name(), job.scenario->name,
             job.variant.name(), took);
  for (const auto& failure : finding.failures) fmt::print("  {}\n", failure);
  std::fflush(stdout);
  return passed;
}

bool run(const std::vector<Job>& jobs, const Part& part, const Programs& programs) {
  std::size_t ran = 0, failed = 0;
  for (auto i = part.part - 1; i < jobs.size(); i += part.of, ++ran)
    if (!run(jobs[i], programs)) ++failed;
  fmt::print("{} of {} failed\n", failed, ran);
  return ran > 0 && failed == 0;
}

}  // namespace

bool run_vcan_suite(const Programs& programs, std::string_view named) {
  auto manuals = manuals_on_can();
  std::ranges::move(makes(), std::back_inserter(manuals));
  return run(all_jobs(manuals, named), {}, programs);
}

bool run_vcan_sample(const Programs& programs, const Part& part) {
  const auto manuals = manuals_on_can(), of_makers = makes();
  return run(sample_of_jobs(manuals, of_makers), part, programs);
}

}  // namespace axisd::conformance
