// gtest's main; `test_conformance --matrix` prints the capability matrix instead.
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <cstdio>
#include <string_view>

#include "tests/conformance/scenario.hpp"

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  if (argc != 2 || std::string_view(argv[1]) != "--matrix") return RUN_ALL_TESTS();
  spdlog::set_level(spdlog::level::off);
  std::vector<std::string> failures;
  std::fputs(axisd::conformance::capability_matrix(failures).c_str(), stdout);
  for (const auto& failure : failures) std::fprintf(stderr, "%s\n", failure.c_str());
  return failures.empty() ? 0 : 1;
}
