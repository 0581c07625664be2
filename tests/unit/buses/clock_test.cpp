#include "buses/clock.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/virtual_world.hpp"

namespace axisd {
namespace {

using namespace std::chrono_literals;

/// What continues a cadence may be late already when it is asked for.
TEST(VirtualClock, WhatIsAskedForInThePastIsDueNow) {
  test::VirtualWorld world;
  const auto begun = world.now();
  world.run_for(100ms);
  std::vector<TimePoint> called;
  const auto late = world.clock().call_at(begun, [&] { called.push_back(world.now()); });
  const auto later = world.clock().call_at(begun + 150ms, [&] { called.push_back(world.now()); });
  world.run_for(100ms);
  EXPECT_EQ(called, (std::vector<TimePoint>{begun + 100ms, begun + 150ms}));
}

}  // namespace
}  // namespace axisd
