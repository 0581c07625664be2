#include "buses/modbus_rtu/punctual_wait.hpp"

#include <gtest/gtest.h>

namespace axisd::modbus_rtu {
namespace {

using namespace std::chrono_literals;

constexpr TimePoint when{10s};

void wait(LeastLatency& latency, Duration late) { latency.note(when, when + late); }

TEST(UsualLatency, HalfOfTheWaitsEndLater) {
  UsualLatency latency;
  EXPECT_EQ(latency.asked_for(when), when);
  int too_soon = 0;
  constexpr int waits = 1000, begun = 200, counted = waits - begun;
  for (int i = 0; i < waits; ++i) {
    const auto asked = latency.asked_for(when);
    const auto woken = asked + 20us + (i * 7919 % 100) * 100ns + 50ns;  // 20 to 30 us late
    if (i >= begun && woken < when) ++too_soon;
    latency.note(asked, woken);
  }
  EXPECT_NEAR(too_soon, 0.5 * counted, 0.05 * counted);
}

TEST(UsualLatency, OneLateWaitIsNotUsual) {
  UsualLatency latency;
  latency.note(when, when + 5ms);
  EXPECT_EQ(latency.asked_for(when), when - UsualLatency::step);
}

TEST(UsualLatency, NeverAsksForMuchSooner) {
  UsualLatency latency;
  for (int i = 0; i < 1000; ++i) latency.note(when, when + 5ms);
  EXPECT_EQ(latency.asked_for(when), when - longest_latency);
}

TEST(UsualLatency, AWaitThatEndedTooSoonWasNotLate) {
  UsualLatency latency;
  latency.note(when, when - 1us);
  EXPECT_EQ(latency.asked_for(when), when);
}

/// How long before it was seen that came which woke the thread.
Duration lain(const LeastLatency& latency) { return when - latency.came_by(when - 1ms, when); }

TEST(LeastLatency, ReliesOnNothingUntilItIsKnown) {
  LeastLatency latency;
  for (int i = 1; i < LeastLatency::remembered; ++i) {
    wait(latency, 4us);
    EXPECT_EQ(lain(latency), 0us);
  }
  wait(latency, 4us);
  EXPECT_EQ(lain(latency), 4us);
}

TEST(LeastLatency, KeepsToTheLeastAtOnce) {
  LeastLatency latency;
  for (int i = 0; i < LeastLatency::remembered; ++i) wait(latency, 4us);
  wait(latency, 1us);
  EXPECT_EQ(lain(latency), 1us);
}

TEST(LeastLatency, FollowsAMachineThatBecameSlower) {
  LeastLatency latency;
  for (int i = 0; i < LeastLatency::remembered; ++i) wait(latency, 1us);
  for (int i = 1; i < LeastLatency::remembered; ++i) wait(latency, 4us);
  EXPECT_EQ(lain(latency), 1us) << "not slower for long enough yet";
  wait(latency, 4us);
  EXPECT_EQ(lain(latency), 4us);
}

TEST(LeastLatency, AWaitThatEndedTooSoonWasNotLate) {
  LeastLatency latency;
  for (int i = 0; i < LeastLatency::remembered; ++i) wait(latency, -1us);
  EXPECT_EQ(lain(latency), 0us);
}

TEST(LeastLatency, WhatWokeAThreadCameBeforeItWasSeen) {
  LeastLatency latency;
  EXPECT_EQ(latency.came_by(when - 1ms, when), when) << "nothing is known yet";
  for (int i = 0; i < LeastLatency::remembered; ++i) wait(latency, 3us);
  EXPECT_EQ(latency.came_by(when - 1ms, when), when - 3us);
  EXPECT_EQ(latency.came_by(when - 3us, when), when) << "it did not sleep: it may have come just now";
  EXPECT_EQ(latency.came_by(TimePoint::max(), when), when) << "it was not waited for";
}

TEST(LeastLatency, ShortensNoSilenceByMoreThanNobodyNotices) {
  LeastLatency latency;
  for (int i = 0; i < LeastLatency::remembered; ++i) wait(latency, 90us);
  EXPECT_EQ(latency.came_by(when - 1ms, when), when - LeastLatency::surely);
}

TEST(PunctualWait, NeverEndsTooSoon) {
  PunctualWait wait;
  for (int i = 0; i < 3 * LeastLatency::remembered; ++i) {
    const auto due = monotonic_now() + 200us;
    wait.begin(due);
    EXPECT_GE(wait.finish(), due) << i;
  }
}

TEST(PunctualWait, LastsNoLongerThanIsEnough) {
  PunctualWait wait;
  bool asked = false;
  TimePoint due;
  // A sleep that took too long leaves nothing to be asked in: another one.
  for (const auto give_up = monotonic_now() + 30s; !asked && monotonic_now() < give_up;) {
    wait.begin(due = monotonic_now() + 1ms);
    const auto ended = wait.finish([&] { return asked = true; });
    if (asked) EXPECT_LT(ended, due);
  }
  EXPECT_TRUE(asked);
  EXPECT_GE(wait.finish(), due) << "the rest of it";
}

TEST(PunctualWait, AMomentThatHasPassedIsNotWaitedFor) {
  PunctualWait wait;
  const auto past = monotonic_now() - 1s;
  wait.begin(past);
  EXPECT_GE(wait.finish(), past);
}

}  // namespace
}  // namespace axisd::modbus_rtu
