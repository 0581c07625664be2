// gtest's main, and:
//   test_chaos --seed SEED           repeats one episode, with the log
//   test_chaos --faulted NUMBER [SEED]   goes on until so many transactions were struck by a fault
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <span>
#include <string>
#include <string_view>

#include "tests/chaos/episode.hpp"

namespace {

int report(const axisd::chaos::Outcome& outcome) {
  fmt::print(
      "{} transactions, {} of them faulted; {} commands, {} done, {} not executed; {} starts, {} stops "
      "confirmed, "
      "{} positions and {} registers compared; {} violations\n",
      outcome.transactions, outcome.faulted, outcome.commands, outcome.done, outcome.not_executed,
      outcome.starts, outcome.stops, outcome.positions, outcome.marks, outcome.violations);
  return outcome.violations == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  const std::span<char*> arguments(argv, static_cast<std::size_t>(argc));
  const std::string_view mode = argc > 2 ? arguments[1] : "";
  if (mode == "--seed") return report(axisd::chaos::run_episode(std::stoull(arguments[2])));
  spdlog::set_level(spdlog::level::off);
  if (mode == "--faulted")
    return report(
        axisd::chaos::run_episodes(argc > 3 ? std::stoull(arguments[3]) : 1, std::stoull(arguments[2])));
  return RUN_ALL_TESTS();
}
