// gtest's main, and the capability matrix: `test_conformance --matrix` prints what the scenarios showed, with
// the simulators' defaults, plain; rows are abilities, columns are models.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdio>
#include <string_view>

#include "devices/descriptor.hpp"
#include "tests/conformance/scenario.hpp"

namespace {

using namespace axisd;
using namespace axisd::conformance;

int print_matrix() {
  spdlog::set_level(spdlog::level::off);
  std::vector<Manual> manuals;
  for (const auto* model : drive_models()) manuals.emplace_back(std::string(model->model));
  std::string head = "| |", rule = "| --- |";
  for (const auto& manual : manuals) {
    head += fmt::format(" {} |", manual.model());
    rule += " --- |";
  }
  fmt::print("{}\n{}\n", head, rule);
  bool all = true;
  for (const auto& subject : subjects())
    for (const auto& scenario : subject.scenarios) {
      std::string row = fmt::format("| {} |", scenario.ability);
      for (const auto& manual : manuals) {
        const auto finding = run_scenario(scenario, manual, {});
        row += fmt::format(" {} |", finding.failures.empty() ? finding.shown : "FAILED");
        for (const auto& failure : finding.failures) fmt::print(stderr, "{}\n", failure);
        all = all && finding.failures.empty();
      }
      fmt::print("{}\n", row);
    }
  return all ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  if (argc == 2 && std::string_view(argv[1]) == "--matrix") return print_matrix();
  return RUN_ALL_TESTS();
}
