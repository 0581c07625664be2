// gtest's main, and:
//   test_chaos --seed SEED               repeats one episode, with the log
//   test_chaos --faulted NUMBER [SEED]   goes on until so many transactions were struck by a fault
//   test_chaos --seed-can SEED, --faulted-can NUMBER [SEED]   the same with a CAN network; NUMBER of its own
//   test_chaos --seed-index SEED, --faulted-index NUMBER [SEED]   the same where 16 axes of one line index
//   test_chaos --seed-generic SEED, --faulted-generic NUMBER [SEED]   with drives made of data sheets on it
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <span>
#include <string>
#include <string_view>

#include "tests/chaos/episode.hpp"

namespace {

using axisd::chaos::PlantKind;

int report(const axisd::chaos::Outcome& outcome) {
  fmt::print("{} transactions on lines, {} of them faulted; {} on CAN, {} of them faulted\n",
             outcome.transactions, outcome.faulted, outcome.can_transactions, outcome.can_faulted);
  fmt::print("{} commands, {} done, {} not executed; {} starts ({} by SYNC), {} more by terminals\n",
             outcome.commands, outcome.done, outcome.not_executed, outcome.starts, outcome.by_sync,
             outcome.by_terminal);
  fmt::print(
      "{} stops confirmed; {} departures, {} distances, {} positions and {} registers compared; {} "
      "violations\n",
      outcome.stops, outcome.departures, outcome.distances, outcome.positions, outcome.marks,
      outcome.violations);
  return outcome.violations == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  const std::span<char*> arguments(argv, static_cast<std::size_t>(argc));
  const std::string_view mode = argc > 2 ? arguments[1] : "";
  const auto kind = mode.ends_with("-can")       ? PlantKind::network
                    : mode.ends_with("-index")   ? PlantKind::full_line
                    : mode.ends_with("-generic") ? PlantKind::generic
                                                 : PlantKind::lines;
  if (mode.starts_with("--seed")) return report(axisd::chaos::run_episode(kind, std::stoull(arguments[2])));
  spdlog::set_level(spdlog::level::off);
  if (mode.starts_with("--faulted"))
    return report(axisd::chaos::run_episodes(kind, argc > 3 ? std::stoull(arguments[3]) : 1,
                                             std::stoull(arguments[2])));
  return RUN_ALL_TESTS();
}
