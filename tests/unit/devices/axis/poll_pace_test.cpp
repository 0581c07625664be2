#include "devices/axis/poll_pace.hpp"

#include <gtest/gtest.h>

namespace axisd {
namespace {

using namespace std::chrono_literals;
using State = PollPace::State;

constexpr TimePoint now{10s};

PollPace pace() { return {20ms, 200ms}; }

TEST(PollPace, UsuallyItFollowsTheSettings) {
  EXPECT_EQ(pace().state(now), State::usual);
  EXPECT_EQ(pace().next(now, true), now + 20ms);
  EXPECT_EQ(pace().next(now, false), now + 200ms);
}

TEST(PollPace, WhereSomethingIsAboutToBeSeenItIsAsFastAsTheBusCan) {
  auto fast = pace();
  fast.expect(now, 100ms);
  EXPECT_EQ(fast.state(now), State::fast);
  EXPECT_EQ(fast.next(now, true), now + fastest_poll);
  EXPECT_EQ(fast.next(now, false), now + 200ms) << "an axis at rest has nothing to tell";
  EXPECT_EQ(fast.state(now + 100ms), State::usual);
  EXPECT_EQ(fast.next(now + 100ms, true), now + 120ms);
}

TEST(PollPace, NoReadingIsLaterThanWhatIsExpected) {
  auto later = pace();
  later.expect(now + 15ms, 100ms);
  EXPECT_EQ(later.state(now), State::usual);
  EXPECT_EQ(later.next(now, true), now + 15ms);
  EXPECT_EQ(later.next(now - 5ms, true), now + 15ms);
  EXPECT_EQ(later.next(now - 10ms, true), now + 2500us) << "in equal steps: none just before it";
  EXPECT_EQ(later.next(now - 25ms, true), now - 5ms);
}

TEST(PollPace, TheFirstReadingAtTheEndOfAMotionIsAwaited) {
  auto fast = pace();
  fast.expect(now, 100ms);
  EXPECT_EQ(fast.awaited_from(), TimePoint::max());
  fast.expect_end(now, 100ms);
  fast.seen(now - 1ms, true);
  EXPECT_EQ(fast.awaited_from(), now);
  fast.seen(now, false);
  EXPECT_EQ(fast.awaited_from(), TimePoint::max());
  fast.expect_end(now, 100ms);
  fast.not_answered();
  EXPECT_EQ(fast.awaited_from(), TimePoint::max()) << "a silent drive keeps nobody waiting again";
  EXPECT_EQ(fast.state(now), State::fast);
}

TEST(PollPace, NothingIsReadJustBeforeTheEnd) {
  auto quiet = pace();
  quiet.expect_end(now, 100ms);
  EXPECT_EQ(quiet.next(now - quiet_before_end, true), now);
  EXPECT_EQ(quiet.next(now - quiet_before_end - 10ms, true), now - 40ms);
  EXPECT_EQ(quiet.next(now - 100ms, true), now - 80ms);
  quiet.seen(now, true);
  EXPECT_EQ(quiet.next(now + 200ms, true), now + 220ms);
}

TEST(PollPace, WhereItWasTooEarlyTheNextIsLater) {
  auto fast = pace();
  fast.expect_end(now, 100ms);
  fast.seen(now, true);
  EXPECT_EQ(fast.state(now), State::fast) << "the end is still to come";
  fast.expect_end(now, 100ms);
  EXPECT_EQ(fast.awaited_from(), now + 1ms);
  EXPECT_EQ(fast.next(now, true), now + 1ms);
  for (int i = 0; i < 100; ++i) {
    fast.seen(now + 1s, true);
    fast.expect_end(now, 100ms);
  }
  EXPECT_EQ(fast.awaited_from(), now + 20ms);
  for (int i = 0; i < 400; ++i) {
    fast.seen(now + 1s, false);
    fast.expect_end(now, 100ms);
  }
  EXPECT_EQ(fast.awaited_from(), now);
}

TEST(PollPace, WhatHasComeIsExpectedNoMore) {
  auto fast = pace();
  fast.expect_end(now, 100ms);
  fast.came();
  EXPECT_EQ(fast.state(now), State::usual);
  EXPECT_EQ(fast.awaited_from(), TimePoint::max());
  EXPECT_EQ(fast.next(now, true), now + 20ms);
}

TEST(PollPace, QuietEndsAtItsTimeAndGoesBeforeFast) {
  auto quiet = pace();
  quiet.expect(now, 100ms);
  quiet.keep_quiet(now + 50ms);
  EXPECT_EQ(quiet.state(now), State::quiet);
  EXPECT_EQ(quiet.quiet_until(), now + 50ms);
  EXPECT_EQ(quiet.state(now + 50ms), State::fast);
}

}  // namespace
}  // namespace axisd
