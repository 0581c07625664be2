#include "buses/modbus_rtu/punctual_wait.hpp"

#include <gtest/gtest.h>

namespace axisd::modbus_rtu {
namespace {

using namespace std::chrono_literals;

constexpr TimePoint when{10s};

void wait(WakeLatency& latency, Duration late) { latency.note(when, when + late); }

TEST(WakeLatency, AsksForNothingSoonerUntilItIsKnown) {
  WakeLatency latency;
  for (int i = 1; i < WakeLatency::remembered; ++i) {
    EXPECT_EQ(latency.asked_for(when), when);
    wait(latency, 40us);
  }
  wait(latency, 40us);
  EXPECT_EQ(latency.asked_for(when), when - 40us);
}

TEST(WakeLatency, KeepsToTheLeastAtOnce) {
  WakeLatency latency;
  for (int i = 0; i < WakeLatency::remembered; ++i) wait(latency, 40us);
  wait(latency, 7us);
  EXPECT_EQ(latency.asked_for(when), when - 7us);
}

TEST(WakeLatency, FollowsAMachineThatBecameSlower) {
  WakeLatency latency;
  for (int i = 0; i < WakeLatency::remembered; ++i) wait(latency, 10us);
  for (int i = 1; i < WakeLatency::remembered; ++i) wait(latency, 60us);
  EXPECT_EQ(latency.asked_for(when), when - 10us) << "not slower for long enough yet";
  wait(latency, 60us);
  EXPECT_EQ(latency.asked_for(when), when - 60us);
}

TEST(WakeLatency, NeverAsksForMuchSooner) {
  WakeLatency latency;
  for (int i = 0; i < 2 * WakeLatency::remembered; ++i) wait(latency, 5ms);
  EXPECT_EQ(latency.asked_for(when), when - WakeLatency::most);
}

TEST(WakeLatency, AWaitThatEndedTooSoonWasNotLate) {
  WakeLatency latency;
  for (int i = 0; i < WakeLatency::remembered; ++i) wait(latency, -1us);
  EXPECT_EQ(latency.asked_for(when), when);
}

TEST(WakeLatency, WhatWokeAThreadCameBeforeItWasSeen) {
  WakeLatency latency;
  EXPECT_EQ(latency.came_by(when - 1ms, when), when) << "nothing is known yet";
  for (int i = 0; i < WakeLatency::remembered; ++i) wait(latency, 3us);
  EXPECT_EQ(latency.came_by(when - 1ms, when), when - 3us);
  EXPECT_EQ(latency.came_by(when - 3us, when), when) << "it did not sleep: it may have come just now";
  EXPECT_EQ(latency.came_by(TimePoint::max(), when), when) << "it was not waited for";
}

TEST(WakeLatency, ShortensNoSilenceByMoreThanNobodyNotices) {
  WakeLatency latency;
  for (int i = 0; i < WakeLatency::remembered; ++i) wait(latency, 90us);
  EXPECT_EQ(latency.came_by(when - 1ms, when), when - WakeLatency::surely);
}

TEST(PunctualWait, NeverEndsTooSoon) {
  PunctualWait wait;
  for (int i = 0; i < 3 * WakeLatency::remembered; ++i) {
    const auto due = monotonic_now() + 200us;
    wait.begin(due);
    EXPECT_GE(wait.finish(), due) << i;
  }
}

TEST(PunctualWait, AMomentThatHasPassedIsNotWaitedFor) {
  PunctualWait wait;
  const auto past = monotonic_now() - 1s;
  wait.begin(past);
  EXPECT_GE(wait.finish(), past);
}

}  // namespace
}  // namespace axisd::modbus_rtu
