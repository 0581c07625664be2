#include "buses/modbus_rtu/reply_pace.hpp"

#include <gtest/gtest.h>

#include <random>

namespace axisd::modbus_rtu {
namespace {

using namespace std::chrono_literals;

constexpr Duration on_wire = 2ms;

/// A node as it answers after `turnaround`; the sleep is over `late` after its time, and to read takes
/// `reading`.
Duration ask(ReplyPace& pace, Duration turnaround, Duration late = {}, Duration reading = {}) {
  const auto slept = pace.quiet(1, on_wire);
  const auto woken = slept == Duration::zero() ? std::nullopt : std::optional(slept + late);
  pace.complete(1, on_wire, std::max(woken.value_or(Duration::zero()), turnaround + on_wire) + reading,
                woken);
  return slept;
}

TEST(ReplyPace, SleepsUntilTheReplyIsAboutToBeComplete) {
  ReplyPace pace;
  for (int i = 0; i < ReplyPace::measured; ++i)
    EXPECT_EQ(ask(pace, 5ms), Duration::zero()) << "not known yet";
  int unslept = 0;
  for (int i = 0; i < 3 * ReplyPace::remembered; ++i) {
    const auto slept = ask(pace, 5ms);
    if (slept == Duration::zero())
      ++unslept;
    else
      EXPECT_EQ(slept, 7ms - ReplyPace::margin);
  }
  EXPECT_EQ(unslept, 3) << "now and then one is measured";
  EXPECT_EQ(pace.quiet(1, 12ms), 17ms - ReplyPace::margin) << "a longer reply of the same node";
  EXPECT_EQ(pace.quiet(2, on_wire), Duration::zero()) << "another node";
}

TEST(ReplyPace, KeepsToTheSoonest) {
  ReplyPace pace;
  for (const auto turnaround : {9ms, 5ms, 7ms}) ask(pace, turnaround);
  EXPECT_EQ(ask(pace, 4985us), 7ms - ReplyPace::margin);
  EXPECT_EQ(ask(pace, 8ms), 6985us - ReplyPace::margin) << "and to one that is sooner yet";
  EXPECT_EQ(ask(pace, 8ms), 6985us - ReplyPace::margin) << "later ones are accidents";
}

TEST(ReplyPace, FollowsANodeThatBecameSlower) {
  ReplyPace pace;
  for (int i = 0; i < 5; ++i) ask(pace, 2ms);
  ask(pace, 10ms);
  EXPECT_LT(pace.quiet(1, on_wire), 5ms) << "one slow reply is an accident";
  for (int i = 0; i < 2 * ReplyPace::remembered; ++i) ask(pace, 10ms);
  EXPECT_GT(pace.quiet(1, on_wire), 11ms);
}

TEST(ReplyPace, OneThatBecameFasterCostsAFewRepliesOfItsTime) {
  ReplyPace pace;
  for (int i = 0; i < 5; ++i) ask(pace, 40ms);
  for (int i = 0; i < ReplyPace::suspicious; ++i)
    EXPECT_GT(ask(pace, 2ms), 41ms) << "not known in advance, but all of them lay ready";
  EXPECT_EQ(ask(pace, 2ms), Duration::zero()) << "measured anew";
  EXPECT_EQ(ask(pace, 2ms), 4ms - ReplyPace::margin);
}

TEST(ReplyPace, ANodeThatAnswersIrregularlyLosesNearlyNothing) {
  ReplyPace pace;
  std::minstd_rand engine(1);
  Duration in_all{}, lost{}, slept_in_all{};
  for (int i = 0; i < 5000; ++i) {
    const auto turnaround = std::uniform_int_distribution(2000, 10000)(engine) * 1us;
    const auto slept = ask(pace, turnaround);
    in_all += turnaround + on_wire;
    lost += std::max(slept - turnaround - on_wire, Duration::zero());
    slept_in_all += slept;
  }
  EXPECT_LT(100 * lost, in_all);
  EXPECT_GT(3 * slept_in_all, in_all) << "and most of what can be slept through is";
}

TEST(ReplyPace, WokenTooLateNowAndThenChangesNothing) {
  ReplyPace pace;
  for (int i = 0; i < ReplyPace::measured; ++i) ask(pace, 5ms);
  for (int i = 0; i < 3 * ReplyPace::remembered; ++i) {
    const auto slept = ask(pace, 5ms, i % ReplyPace::suspicious == 0 ? Duration::zero() : 1ms);
    if (slept > Duration::zero()) EXPECT_EQ(slept, 7ms - ReplyPace::margin);
  }
}

TEST(ReplyPace, OneThatBecameFasterIsNoticedThoughItTakesLongToRead) {
  for (const auto reading : {5us, 15us, 30us, 200us}) {
    ReplyPace pace;
    for (int i = 0; i < ReplyPace::measured; ++i) ask(pace, 40ms);
    for (int i = 0; i < 2 * ReplyPace::remembered; ++i) ask(pace, 2ms, {}, reading);
    for (int i = 0; i < 10 * ReplyPace::remembered; ++i)
      ASSERT_LE(ask(pace, 2ms, {}, reading), 4ms + reading) << reading.count();
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
  for (int i = 0; i < ReplyPace::measured; ++i) pace.complete(1, on_wire, 1900us, {});
  EXPECT_EQ(pace.quiet(1, on_wire), 1900us - ReplyPace::margin);
  for (int i = 0; i < ReplyPace::measured; ++i) pace.complete(2, on_wire, -600us, {});  // no time at all
  EXPECT_EQ(pace.quiet(2, on_wire), Duration::zero());
}

}  // namespace
}  // namespace axisd::modbus_rtu
