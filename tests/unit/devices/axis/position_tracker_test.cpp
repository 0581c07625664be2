#include "devices/axis/position_tracker.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace axisd {
namespace {

Scale half_pulses(bool invert) {
  return Scale({.pulses_per_revolution = 200, .travel_numerator = 100, .invert = invert, .unit = "mm"});
}

TEST(PositionTracker, AHundredThousandThirdsDoNotDrift) {
  for (const bool invert : {false, true}) {
    const auto scale = half_pulses(invert);
    PositionTracker tracker(scale);
    tracker.update(0);
    tracker.set_position(0, PositionTrust::set);
    for (int i = 0; i < 100'000; ++i) {
      auto target = tracker.plan_relative(1.0 / 3);
      tracker.update(static_cast<std::int32_t>(target.counter));
      tracker.reached(target);
    }
    EXPECT_EQ(tracker.counter(), (invert ? -1 : 1) * std::llround(100'000 * (1.0 / 3) * 2));
  }
}

TEST(PositionTracker, APlanThatIsNotCarriedOutChangesNothing) {
  PositionTracker tracker(half_pulses(false));
  tracker.update(0);
  tracker.set_position(0, PositionTrust::set);
  auto first = tracker.plan_absolute(10);
  (void)tracker.plan_absolute(500);
  tracker.update(20);
  tracker.reached(first);
  EXPECT_EQ(tracker.plan_relative(1).counter, 22);
}

/// Near enough to be done is not where the drive stands: a relative move counts from the latter.
TEST(PositionTracker, ATargetThatWasMissedIsNoBase) {
  PositionTracker tracker(half_pulses(false));
  tracker.update(0);
  const auto target = tracker.plan_absolute(50);
  tracker.update(91);
  tracker.reached(target, 0);
  EXPECT_EQ(tracker.plan_relative(1).counter, 93);
  tracker.reached(target, 10);
  EXPECT_EQ(tracker.plan_relative(1).counter, 102);
}

TEST(PositionTracker, ABaseThatTheShaftLeftIsVoid) {
  PositionTracker tracker(half_pulses(false));
  tracker.update(0);
  const auto target = tracker.plan_absolute(50);
  tracker.update(100, 3);
  tracker.reached(target, 3);
  tracker.update(97, 3);
  EXPECT_EQ(tracker.plan_relative(1).counter, 102) << "it only wavers";
  EXPECT_EQ(tracker.deviation(tracker.plan_relative(1)), 3);
  tracker.update(104, 3);
  tracker.update(100, 3);
  EXPECT_EQ(tracker.plan_relative(1).counter, 102);
  tracker.update(400, 3);
  EXPECT_EQ(tracker.plan_relative(1).counter, 402);
  EXPECT_EQ(tracker.again(target).counter, 100) << "an absolute target stays what it was";
}

TEST(PositionTracker, UnwrapsTheCounter) {
  PositionTracker tracker(half_pulses(false));
  constexpr auto most = std::numeric_limits<std::int32_t>::max();
  tracker.update(most - 5);
  tracker.update(std::numeric_limits<std::int32_t>::min() + 4);
  EXPECT_EQ(tracker.counter(), std::int64_t{most} + 5);
  tracker.update(most - 1);
  EXPECT_EQ(tracker.counter(), std::int64_t{most} - 1);
}

TEST(PositionTracker, ZeroingTheCounterKeepsThePosition) {
  PositionTracker tracker(half_pulses(true));
  tracker.update(1'000'000);
  tracker.set_position(7, PositionTrust::homed);
  tracker.rezero(0);
  EXPECT_DOUBLE_EQ(tracker.position(), 7);
  EXPECT_EQ(tracker.counter(), 0);
  EXPECT_EQ(tracker.trust(), PositionTrust::homed);
}

TEST(PositionTracker, ARestartedDriveVoidsThePosition) {
  PositionTracker tracker(half_pulses(false));
  tracker.update(500);
  tracker.set_position(7, PositionTrust::homed);
  tracker.restart(0);
  EXPECT_EQ(tracker.trust(), PositionTrust::unknown);
  EXPECT_EQ(tracker.offset(), 0);
  EXPECT_EQ(tracker.plan_relative(3).counter, 6);
}

}  // namespace
}  // namespace axisd
