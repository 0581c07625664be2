#include "buses/modbus_rtu/reply_pace.hpp"

#include <gtest/gtest.h>

#include <random>

namespace axisd::modbus_rtu {
namespace {

using namespace std::chrono_literals;

constexpr Duration on_wire = 2ms;

/// One reading: the sleep, and how its reply was met.
struct Reading {
  Duration slept;
  Met met = Met::awake;
};

/// Of a node that answers after `turnaround`; the thread wakes `late`, and to read takes `reading`.
Reading ask(ReplyPace& pace, Duration turnaround, Duration late = {}, Duration reading = {}) {
  Reading one{.slept = pace.quiet(1, on_wire)};
  const auto woken = one.slept == Duration::zero() ? Duration::zero() : one.slept + late;
  const auto complete = turnaround + on_wire;
  if (woken > Duration::zero()) one.met = complete <= woken ? Met::ready : Met::awaited;
  pace.complete(1, on_wire, std::max(woken, complete) + reading, one.met);
  return one;
}

void learn(ReplyPace& pace, Duration turnaround) {
  for (int i = 0; i < ReplyPace::measured; ++i)
    EXPECT_EQ(ask(pace, turnaround).slept, Duration::zero()) << "not known yet";
}

/// As many as it takes to find out how late the thread wakes.
void settle(ReplyPace& pace, Duration turnaround, Duration late = {}) {
  for (int i = 0; i < 500; ++i) ask(pace, turnaround, late);
}

TEST(ReplyPace, SleepsUntilOneReplyInThreeLiesReady) {
  for (const auto late : {0us, 7us, 60us}) {
    ReplyPace pace;
    learn(pace, 5ms);
    EXPECT_EQ(pace.quiet(1, on_wire), 7ms + ReplyPace::at_first);
    settle(pace, 5ms, late);
    int ready = 0;
    for (int i = 0; i < 300; ++i) {
      const auto one = ask(pace, 5ms, late);
      EXPECT_LE(std::chrono::abs(one.slept + late - 7ms), ReplyPace::sooner);
      if (one.met == Met::ready) ++ready;
    }
    EXPECT_NEAR(ready, 100, 1) << "woken late by " << late.count() << " us";
    EXPECT_EQ(pace.quiet(1, 4ms) - pace.quiet(1, on_wire), 2ms) << "a longer reply of the same node";
    EXPECT_EQ(pace.quiet(2, on_wire), Duration::zero()) << "another node";
  }
}

TEST(ReplyPace, OfALongReplyTheEndIsWaitedForAwake) {
  ReplyPace pace;
  learn(pace, 9ms);
  for (int i = 0; i < 500; ++i) EXPECT_EQ(ask(pace, 9ms).slept, 9ms) << "not before it can begin";
  EXPECT_EQ(pace.quiet(1, 7ms), 16ms - ReplyPace::awake_after_long);
  EXPECT_EQ(pace.quiet(1, 1ms), 10ms + ReplyPace::at_first) << "which says nothing of shorter ones";
}

TEST(ReplyPace, KeepsToTheSoonest) {
  ReplyPace pace;
  for (const auto turnaround : {7ms, 5ms, 6ms}) ask(pace, turnaround);
  EXPECT_EQ(ask(pace, 4985us).slept, 7ms + ReplyPace::at_first);
  const auto next = ask(pace, 7ms).slept;
  EXPECT_EQ(next, 6985us + ReplyPace::at_first + ReplyPace::later) << "and to one that is sooner yet";
  EXPECT_EQ(ask(pace, 7ms).slept, next + ReplyPace::later) << "later ones are accidents";
}

TEST(ReplyPace, FollowsANodeThatBecameSlower) {
  ReplyPace pace;
  for (int i = 0; i < 5; ++i) ask(pace, 2ms);
  ask(pace, 6ms);
  EXPECT_LT(pace.quiet(1, on_wire), 5ms) << "one slow reply is an accident";
  for (int i = 0; i < 2 * ReplyPace::remembered; ++i) ask(pace, 6ms);
  EXPECT_GT(pace.quiet(1, on_wire), 7ms);
}

TEST(ReplyPace, ASoonestReplyThatNeverCameAgainIsForgottenThoughAThreadWakesLateNowAndThen) {
  ReplyPace pace;
  for (const auto turnaround : {4ms, 5ms, 5ms}) ask(pace, turnaround);
  for (int i = 0; i < 2 * ReplyPace::remembered; ++i) ask(pace, 5ms, i % 20 == 0 ? 2ms : 0ms);
  EXPECT_GT(pace.quiet(1, on_wire), 6900us);
}

TEST(ReplyPace, OneThatBecameFasterCostsAFewRepliesOfItsTime) {
  ReplyPace pace;
  for (int i = 0; i < 5; ++i) ask(pace, 40ms);
  for (int i = 0; i < ReplyPace::suspicious; ++i)
    EXPECT_GT(ask(pace, 2ms).slept, 5ms) << "not known in advance, but all of them lay ready";
  EXPECT_EQ(ask(pace, 2ms).slept, Duration::zero()) << "measured anew";
  EXPECT_LT(ask(pace, 2ms).slept, 4ms);
}

TEST(ReplyPace, ANodeThatAnswersIrregularlyLosesNearlyNothing) {
  for (const int latest_us : {3000, 6000, 7900, 10000}) {
    ReplyPace pace;
    std::minstd_rand engine(1);
    Duration in_all{}, lost{}, slept_in_all{};
    for (int i = 0; i < 50000; ++i) {
      const auto turnaround = std::uniform_int_distribution(2000, latest_us)(engine) * 1us;
      const auto late = std::uniform_int_distribution(30, 50)(engine) * 1us;
      const auto slept = ask(pace, turnaround, late).slept;
      if (i < 25000) continue;
      in_all += turnaround + on_wire;
      if (slept > Duration::zero()) lost += std::max(slept + late - turnaround - on_wire, Duration::zero());
      slept_in_all += slept;
    }
    EXPECT_LT(100 * lost, in_all) << latest_us;
    EXPECT_GT(3 * slept_in_all, in_all) << "and most of what can be slept through is";
  }
}

TEST(ReplyPace, WokenTooLateNowAndThenChangesLittle) {
  ReplyPace pace;
  learn(pace, 5ms);
  settle(pace, 5ms);
  for (int i = 0; i < 3 * ReplyPace::remembered; ++i) {
    const auto slept = ask(pace, 5ms, i % 10 == 0 ? 1ms : 0ms).slept;
    EXPECT_LE(std::chrono::abs(slept - 7ms), 2 * ReplyPace::sooner);
  }
}

TEST(ReplyPace, OneThatBecameFasterIsNoticedThoughItTakesLongToRead) {
  for (const auto reading : {5us, 15us, 30us, 200us}) {
    ReplyPace pace;
    for (int i = 0; i < ReplyPace::measured; ++i) ask(pace, 40ms);
    for (int i = 0; i < 2 * ReplyPace::remembered; ++i) ask(pace, 2ms, {}, reading);
    for (int i = 0; i < 10 * ReplyPace::remembered; ++i)
      ASSERT_LE(ask(pace, 2ms, {}, reading).slept, 4ms + reading) << reading.count();
  }
}

TEST(ReplyPace, ReliesOnNothingAfterSilence) {
  ReplyPace pace;
  for (int i = 0; i < 5; ++i) ask(pace, 5ms);
  pace.forget(1);
  EXPECT_EQ(pace.quiet(1, on_wire), Duration::zero());
}

TEST(ReplyPace, AReplyBeforeItsTimeOnTheWireIsNotSleptOver) {
  ReplyPace pace;  // the adapter's clock, or the end of the request, is off
  for (int i = 0; i < ReplyPace::measured; ++i) pace.complete(1, on_wire, 1900us, Met::awake);
  EXPECT_EQ(pace.quiet(1, on_wire), 1900us + ReplyPace::at_first);
  for (int i = 0; i < ReplyPace::measured; ++i)
    pace.complete(2, on_wire, -600us, Met::awake);  // no time at all
  EXPECT_EQ(pace.quiet(2, on_wire), Duration::zero());
}

}  // namespace
}  // namespace axisd::modbus_rtu
