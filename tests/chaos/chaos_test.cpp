#include <gtest/gtest.h>

#include "tests/chaos/episode.hpp"

namespace axisd::chaos {
namespace {

#if defined(__SANITIZE_ADDRESS__) || __has_feature(address_sanitizer)
constexpr std::uint64_t faulted_share = 3'000;
#else
constexpr std::uint64_t faulted_share = 25'000;
#endif

/// Four tests of one kind, so that they run beside each other.
class Chaos : public ::testing::TestWithParam<int> {};

TEST_P(Chaos, NothingMovesTwiceLateOrByItself) {
  const auto outcome = run_episodes(static_cast<std::uint64_t>(GetParam()) * 1'000'000 + 1, faulted_share);
  // What was judged really happened.
  EXPECT_GE(outcome.faulted, faulted_share);
  const auto often = static_cast<int>(faulted_share / 250);
  EXPECT_GE(outcome.starts, often);
  EXPECT_GE(outcome.done, often);
  EXPECT_GE(outcome.stops, often);
  EXPECT_GE(outcome.positions, often);
  EXPECT_GE(outcome.marks, often);
  EXPECT_GE(outcome.not_executed, often / 50);
}

INSTANTIATE_TEST_SUITE_P(Share, Chaos, ::testing::Range(0, 4));

}  // namespace
}  // namespace axisd::chaos
