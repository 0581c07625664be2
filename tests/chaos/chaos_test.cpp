#include <gtest/gtest.h>

#include "tests/chaos/episode.hpp"

namespace axisd::chaos {
namespace {

#if defined(__SANITIZE_ADDRESS__) || __has_feature(address_sanitizer)
constexpr std::uint64_t faulted_share = 3'000, faulted_can_share = 2'000, faulted_index_share = 1'000,
                        faulted_generic_share = 1'000;
#else
constexpr std::uint64_t faulted_share = 25'000, faulted_can_share = 6'000, faulted_index_share = 8'000,
                        faulted_generic_share = 3'000;
#endif

/// Tests of one kind, so that they run beside each other.
class Chaos : public ::testing::TestWithParam<int> {
 protected:
  [[nodiscard]] static std::uint64_t first_seed() {
    return static_cast<std::uint64_t>(GetParam()) * 1'000'000 + 1;
  }
};
class ChaosCan : public Chaos {};
class ChaosIndex : public Chaos {};
class ChaosGeneric : public Chaos {};

/// What was judged really happened.
void expect_often(const Outcome& outcome, int often) {
  EXPECT_GE(outcome.starts, often);
  EXPECT_GE(outcome.done, often);
  EXPECT_GE(outcome.stops, often);
  EXPECT_GE(outcome.positions, often);
  EXPECT_GE(outcome.distances, often / 4);
  EXPECT_GE(outcome.by_terminal, often / 50);
  EXPECT_GE(outcome.departures, often / 2);
  EXPECT_GE(outcome.not_executed, often / 50);
}

TEST_P(Chaos, NothingMovesTwiceLateOrByItself) {
  const auto outcome = run_episodes(PlantKind::lines, first_seed(), faulted_share);
  EXPECT_GE(outcome.faulted, faulted_share);
  expect_often(outcome, static_cast<int>(faulted_share / 250));
  EXPECT_GE(outcome.marks, static_cast<int>(faulted_share / 250));
}

TEST_P(ChaosCan, NothingMovesTwiceLateOrByItself) {
  const auto outcome = run_episodes(PlantKind::network, first_seed(), faulted_can_share);
  EXPECT_GE(outcome.can_faulted, faulted_can_share);
  EXPECT_GE(outcome.faulted, faulted_can_share / 100);
  expect_often(outcome, static_cast<int>(faulted_can_share / 250));
  EXPECT_GE(outcome.by_sync, 1);
}

TEST_P(ChaosIndex, NothingMovesTwiceLateOrByItself) {
  const auto outcome = run_episodes(PlantKind::full_line, first_seed(), faulted_index_share);
  EXPECT_GE(outcome.faulted, faulted_index_share);
  expect_often(outcome, static_cast<int>(faulted_index_share / 250));
  EXPECT_GE(outcome.starts, static_cast<int>(faulted_index_share / 10));
}

TEST_P(ChaosGeneric, NothingMovesTwiceLateOrByItself) {
  const auto outcome = run_episodes(PlantKind::generic, first_seed(), faulted_generic_share);
  EXPECT_GE(outcome.can_faulted, faulted_generic_share);
  expect_often(outcome, static_cast<int>(faulted_generic_share / 500));
}

INSTANTIATE_TEST_SUITE_P(Share, Chaos, ::testing::Range(0, 3));
INSTANTIATE_TEST_SUITE_P(Share, ChaosCan, ::testing::Range(1, 2));
INSTANTIATE_TEST_SUITE_P(Share, ChaosIndex, ::testing::Range(2, 3));
INSTANTIATE_TEST_SUITE_P(Share, ChaosGeneric, ::testing::Range(2, 3));

}  // namespace
}  // namespace axisd::chaos
