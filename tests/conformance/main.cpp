// gtest's main, and:
//   test_conformance --matrix                                  prints the capability matrix
//   test_conformance --vcan AXISD AXISD_SIM [NAME [PART OF]]   runs the scenarios against these programs, on
//   vcan
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <cstdio>
#include <span>
#include <string>
#include <string_view>

#include "tests/conformance/real/vcan_suite.hpp"
#include "tests/conformance/scenario.hpp"

namespace {

using namespace axisd::conformance;

int print_matrix() {
  spdlog::set_level(spdlog::level::off);
  std::vector<std::string> failures;
  fmt::print("{}", capability_matrix(failures));
  for (const auto& failure : failures) fmt::print(stderr, "{}\n", failure);
  return failures.empty() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  const std::span<char*> arguments(argv, static_cast<std::size_t>(argc));
  const std::string_view mode = argc > 1 ? arguments[1] : "";
  if (mode == "--matrix") return print_matrix();
  if (mode == "--vcan" && (argc == 4 || argc == 5 || argc == 7)) {
    Part part;
    if (argc == 7) part = {.part = std::stoul(arguments[5]), .of = std::stoul(arguments[6])};
    const auto* const named = argc > 4 ? arguments[4] : "";
    return run_vcan_suite({.axisd = arguments[2], .axisd_sim = arguments[3]}, part, named) ? 0 : 1;
  }
  return RUN_ALL_TESTS();
}
