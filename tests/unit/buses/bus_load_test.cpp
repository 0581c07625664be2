#include "buses/bus_load.hpp"

#include <gtest/gtest.h>

namespace axisd {
namespace {

using namespace std::chrono_literals;

constexpr TimePoint start{1h + 400ms};

TEST(BusLoad, OfNothingIsZero) {
  const BusLoad load(start);
  EXPECT_EQ(load.recent(start), 0);
  EXPECT_EQ(load.overall(start), 0);
  EXPECT_EQ(load.recent(start + 1min), 0);
}

TEST(BusLoad, CountsWhatWasOccupiedAcrossSeconds) {
  BusLoad load(start);
  load.add(start + 100ms, start + 1100ms);
  EXPECT_DOUBLE_EQ(load.overall(start + 2s), 0.5);
  EXPECT_DOUBLE_EQ(load.recent(start + 2s), 0.5);
  EXPECT_EQ(load.occupied(), 1s);
}

TEST(BusLoad, ForgetsWhatIsOlderThanItsWindow) {
  BusLoad load(start);
  load.add(start, start + 5s);
  EXPECT_DOUBLE_EQ(load.recent(start + 5s), 1);
  EXPECT_EQ(load.recent(start + 20s), 0);
  EXPECT_DOUBLE_EQ(load.overall(start + 20s), 0.25);
}

TEST(BusLoad, OfAConstantShareIsThatShareAtAnyTime) {
  BusLoad load(start);
  for (auto t = start; t < start + 40s; t += 10ms) load.add(t, t + 3ms);
  for (Duration t = 37s; t < 40s; t += 100ms) {
    BusLoad until(start);
    for (auto begin = start; begin < start + t; begin += 10ms) until.add(begin, begin + 3ms);
    EXPECT_NEAR(until.recent(start + t), 0.3, 0.002);
  }
  EXPECT_NEAR(load.overall(start + 40s), 0.3, 1e-9);
}

TEST(BusLoad, TakesAnIntervalLongerThanItsWindow) {
  BusLoad load(start);
  load.add(start, start + 1min);
  EXPECT_DOUBLE_EQ(load.recent(start + 1min), 1);
  EXPECT_EQ(load.occupied(), 1min);
}

TEST(BusLoad, LeavesOutWhatWasBeforeItsStart) {
  BusLoad load(start);
  load.add(start - 1s, start + 1s);
  EXPECT_EQ(load.occupied(), 1s);
}

}  // namespace
}  // namespace axisd
