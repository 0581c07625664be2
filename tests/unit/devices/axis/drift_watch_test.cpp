#include "devices/axis/drift_watch.hpp"

#include <gtest/gtest.h>

namespace axisd {
namespace {

using namespace std::chrono_literals;
using State = DriftWatch::State;

constexpr TimePoint checked{10s};
constexpr auto period = 5s;

TEST(DriftWatch, WhatIsFoundIsNewsOnce) {
  DriftWatch drift(period);
  EXPECT_FALSE(drift.found(""));
  EXPECT_EQ(drift.state(), State::as_configured);
  EXPECT_TRUE(drift.found("X0"));
  EXPECT_EQ(drift.state(), State::drifted);
  EXPECT_FALSE(drift.found("X0"));
  EXPECT_TRUE(drift.found("X0, X1"));
  EXPECT_EQ(drift.text(), "X0, X1");
  EXPECT_TRUE(drift.found(""));
  EXPECT_EQ(drift.state(), State::as_configured);
}

TEST(DriftWatch, AComparisonWaitsForAProofButNotForEver) {
  DriftWatch drift(period);
  drift.applied(checked);
  EXPECT_FALSE(drift.is_next(checked + period - 1ms, true));
  EXPECT_TRUE(drift.is_next(checked + period, true));
  EXPECT_FALSE(drift.is_next(checked + period, false));
  EXPECT_FALSE(drift.is_next(checked + period + 2 * continuity_period - 1ms, false));
  EXPECT_TRUE(drift.is_next(checked + period + 2 * continuity_period, false));
}

TEST(DriftWatch, TheNewestComparisonCounts) {
  DriftWatch drift(period);
  const auto first = drift.begin(checked);
  EXPECT_FALSE(drift.is_next(checked + 10 * period, true)) << "it is under way";
  const auto second = drift.begin(checked + 1s);
  EXPECT_FALSE(drift.end(first));
  EXPECT_FALSE(drift.is_next(checked + 10 * period, true));
  EXPECT_TRUE(drift.end(second));
  EXPECT_FALSE(drift.end(second));
  EXPECT_FALSE(drift.is_next(checked + period, true)) << "from when it began";
  EXPECT_TRUE(drift.is_next(checked + 1s + period, true));
  const auto third = drift.begin(checked);
  drift.applied(checked);
  EXPECT_FALSE(drift.end(third)) << "the drive was configured meanwhile";
}

TEST(DriftWatch, WhatIsGivenUpIsComparedAgain) {
  DriftWatch drift(period);
  drift.applied(checked);
  drift.give_up();  // nothing
  EXPECT_FALSE(drift.is_next(checked + period - 1ms, true));
  const auto first = drift.begin(checked + period);
  drift.give_up();
  EXPECT_FALSE(drift.end(first));
  EXPECT_TRUE(drift.is_next(checked + period, true)) << "as if it had not begun";
  EXPECT_TRUE(drift.end(drift.begin(checked + period)));
  drift.give_up();
  EXPECT_FALSE(drift.is_next(checked + period, true)) << "it had ended before";
}

}  // namespace
}  // namespace axisd
