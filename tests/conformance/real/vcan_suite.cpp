#include "tests/conformance/real/vcan_suite.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/conformance/scenario.hpp"

namespace axisd::conformance {

namespace {

struct Job {
  const Scenario* scenario;
  const Manual* manual;
  Variant variant;
};

/// Each of them takes as long as twenty others.
constexpr std::string_view long_ones[] = {"every_alarm", "thousand_moves"};

/// Motion also inverted; what runs the same driver from a data sheet is plain. Long ones come first, so that
/// guests side by side have one each.
std::vector<Job> jobs(const std::vector<Manual>& manuals, std::string_view named) {
  std::vector<Job> all;
  std::ptrdiff_t long_jobs = 0;
  const auto add = [&](const Job& job) {
    const bool is_long = std::ranges::find(long_ones, job.scenario->name) != std::end(long_ones);
    all.insert(is_long ? all.begin() + long_jobs++ : all.end(), job);
  };
  for (const auto& manual : manuals)
    for (const auto& subject : subjects())
      for (const auto& scenario : subject.scenarios) {
        if (manual.lacks(scenario.name) || scenario.name.find(named) == std::string_view::npos) continue;
        add({.scenario = &scenario, .manual = &manual, .variant = {}});
        if (subject.name == "motion" && !manual.has("data_sheet"))
          add({.scenario = &scenario, .manual = &manual, .variant = {.invert = true}});
      }
  return all;
}

bool run(const Job& job, const Programs& programs) {
  const auto begin = monotonic_now();
  const auto make_target = [&](const Plant& plant) { return make_process_target(programs, "vcan0", plant); };
  const auto finding = run_scenario(*job.scenario, *job.manual, job.variant, make_target, true);
  const auto took = std::chrono::duration<double>(monotonic_now() - begin).count();
  const bool passed = finding.failures.empty();
  fmt::print("{} {} {} {} ({:.1f} s)\n", passed ? "passed" : "FAILED", job.manual->model(),
             job.scenario->name, job.variant.name(), took);
  for (const auto& failure : finding.failures) fmt::print("  {}\n", failure);
  std::fflush(stdout);
  return passed;
}

}  // namespace

bool run_vcan_suite(const Programs& programs, const Part& part, std::string_view named) {
  std::vector<Manual> manuals;
  for (const auto& model : models())
    if (Manual manual(model); manual.bus() == "canopen") manuals.push_back(std::move(manual));
  const auto all = jobs(manuals, named);
  std::size_t ran = 0, failed = 0;
  for (auto i = part.part - 1; i < all.size(); i += part.of, ++ran)
    if (!run(all[i], programs)) ++failed;
  fmt::print("{} of {} failed\n", failed, ran);
  return ran > 0 && failed == 0;
}

}  // namespace axisd::conformance
