#include "buses/latency_histogram.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace axisd {
namespace {

using namespace std::chrono_literals;

TEST(LatencyHistogram, HasTheBoundsThatTheContractStates) {
  for (std::size_t i = 0; i + 1 < LatencyHistogram::bucket_count; ++i) {
    const double stated = 0.1e-3 * std::exp2(static_cast<double>(i) / 4);
    EXPECT_NEAR(std::chrono::duration<double>(LatencyHistogram::bound(i)).count() / stated, 1, 1e-5) << i;
  }
  EXPECT_EQ(LatencyHistogram::bound(LatencyHistogram::bucket_count - 1), Duration::max());
}

TEST(LatencyHistogram, CountsEachLatencyInTheBucketWhoseBoundItDoesNotExceed) {
  LatencyHistogram histogram;
  histogram.add(0ms);
  histogram.add(LatencyHistogram::bound(0));
  histogram.add(LatencyHistogram::bound(0) + 1ns);
  histogram.add(LatencyHistogram::bound(40));
  histogram.add(1h);
  const auto& counts = histogram.counts();
  EXPECT_EQ(counts.at(0), 2U);
  EXPECT_EQ(counts.at(1), 1U);
  EXPECT_EQ(counts.at(40), 1U);
  EXPECT_EQ(counts.back(), 1U);
  EXPECT_EQ(std::accumulate(counts.begin(), counts.end(), 0U), 5U);
  EXPECT_EQ(histogram.longest(), 1h);
  EXPECT_EQ(histogram.sum(), 1h + 1ns + 2 * LatencyHistogram::bound(0) + LatencyHistogram::bound(40));
}

}  // namespace
}  // namespace axisd
