#include "devices/axis/observed_times.hpp"

#include <gtest/gtest.h>

namespace axisd {
namespace {

using namespace std::chrono_literals;

constexpr TimePoint asked{10s};

/// A stop whose frame ended so long after its request.
std::optional<ObservedTimes::Late> stopped(ObservedTimes& times, Duration after, bool all = false) {
  times.stop_requested(asked, all);
  const auto late = times.stop_sent(asked + after, true);
  times.standstill_confirmed(asked + after + 100ms);
  return late;
}

TEST(ObservedTimes, KeepsTheLongestOfEachKindOfStop) {
  ObservedTimes times;
  for (const auto after : {3ms, 8ms, 5ms}) EXPECT_FALSE(stopped(times, after));
  EXPECT_FALSE(stopped(times, 20ms, true));
  EXPECT_EQ(times.values().stop_frame, 8ms);
  EXPECT_EQ(times.values().standstill, 108ms);
  EXPECT_EQ(times.values().stop_frame_all, 20ms);
  EXPECT_EQ(times.values().standstill_all, 120ms);
}

TEST(ObservedTimes, CountsEachStopOnceWhereTheBusCountsThem) {
  StopDelays delays;
  ObservedTimes one(&delays), other(&delays);
  stopped(one, 3ms);
  stopped(other, 5ms);
  stopped(other, 20ms, true);
  one.stop_requested(asked, false);
  one.stop_sent(asked + 7ms, false);
  one.stop_sent(asked + 30ms, true);  // its repetition
  one.stop_failed();
  EXPECT_EQ(delays.some.frame.sum(), 15ms);
  EXPECT_EQ(delays.some.frame.longest(), 7ms);
  EXPECT_EQ(delays.some.standstill.sum(), 208ms);
  EXPECT_EQ(delays.all.frame.sum(), 20ms);
  EXPECT_EQ(delays.all.standstill.sum(), 120ms);
}

TEST(ObservedTimes, TellsOnceWhatTookLongerThanPromised) {
  ObservedTimes times;
  times.expect_stop_within(6ms);
  EXPECT_FALSE(stopped(times, 6ms));
  const auto late = stopped(times, 7ms);
  ASSERT_TRUE(late);
  EXPECT_EQ(late->seen, 7ms);
  EXPECT_EQ(late->expected, 6ms);
  EXPECT_FALSE(stopped(times, 9ms)) << "once";
  EXPECT_EQ(times.values().stop_frame, 9ms) << "but it is noted";
}

TEST(ObservedTimes, OnlyTheFirstFrameOfAStopCounts) {
  ObservedTimes times;
  times.expect_stop_within(6ms);
  times.stop_requested(asked, false);
  EXPECT_FALSE(times.stop_sent(asked - 1ms, true)) << "that of an earlier stop";
  EXPECT_FALSE(times.stop_sent(asked + 4ms, true));
  EXPECT_FALSE(times.stop_sent(asked + 40ms, true)) << "its repetition";
  EXPECT_EQ(times.values().stop_frame, 4ms);
}

/// A frame that nobody answered counts once, and accuses nobody; the first that was answered counts, too.
TEST(ObservedTimes, StopFramesThatNobodyAnswered) {
  ObservedTimes times;
  times.expect_stop_within(10ms);
  times.stop_requested(asked, false);
  EXPECT_FALSE(times.stop_sent(asked + 20ms, false));
  EXPECT_EQ(times.values().stop_frame, 20ms);
  EXPECT_FALSE(times.stop_sent(asked + 30ms, false)) << "its repetition";
  EXPECT_EQ(times.values().stop_frame, 20ms);
  EXPECT_TRUE(times.stop_sent(asked + 40ms, true));
  EXPECT_EQ(times.values().stop_frame, 40ms);
  EXPECT_FALSE(times.stop_sent(asked + 50ms, true));
  EXPECT_EQ(times.values().stop_frame, 40ms);
}

}  // namespace
}  // namespace axisd
