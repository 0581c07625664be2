#include "api/web/gateway/lateness.hpp"

#include <gtest/gtest.h>

namespace axisd::web {
namespace {

using namespace std::chrono_literals;

constexpr TimePoint start{Duration(1h)};

TEST(Lateness, IsCountedFromTheFastest) {
  Lateness lateness;
  EXPECT_EQ(lateness.of(5000, start), 0ms);
  EXPECT_EQ(lateness.of(5100, start + 90ms), 0ms) << "faster than the first";
  EXPECT_NEAR(static_cast<double>(lateness.of(5200, start + 340ms).count()), 150e6, 0.1e6);
}

TEST(Lateness, OutlivesThePagesClockComingRound) {
  Lateness lateness;
  (void)lateness.of(0xFFFFFFF0U, start);
  EXPECT_LT(lateness.of(0x10, start + 32ms), 1ms);
  EXPECT_GT(lateness.of(0x20, start + 1048ms), 999ms);
}

TEST(Lateness, ForgivesClocksThatDriftApart) {
  Lateness lateness;
  constexpr double pace = 1 - 100e-6;  // the page's clock is slow
  for (int second = 0; second < 8 * 3600; second += 10) {
    const auto sent = static_cast<std::uint32_t>(second * 1000 * pace);
    ASSERT_LT(lateness.of(sent, start + std::chrono::seconds(second)), 3ms) << second;
  }
}

TEST(Lateness, AMessageOfBeforeTheLastOneIsLateAsWell) {
  Lateness lateness;
  (void)lateness.of(5000, start);
  (void)lateness.of(5300, start + 300ms);
  EXPECT_GT(lateness.of(5100, start + 400ms), 299ms);
}

}  // namespace
}  // namespace axisd::web
