#include "devices/axis/unseen_start.hpp"

#include <gtest/gtest.h>

namespace axisd {
namespace {

using namespace std::chrono_literals;
using State = UnseenStart::State;

constexpr TimePoint sent{10s};
constexpr auto window_end = sent + 500ms;

struct Start {
  Start() { number = start.sending(100, sent); }
  bool look(TimePoint asked_at, bool moving = false, bool elsewhere = false) {
    return start.look({.asked_at = asked_at, .moving = moving, .elsewhere = elsewhere});
  }
  UnseenStart start;
  int number = 0;
};

TEST(UnseenStart, NothingWasStartedAtFirst) {
  UnseenStart start;
  EXPECT_FALSE(start.may_begin());
  EXPECT_FALSE(start.look({.asked_at = sent, .moving = true}));
  start.left(sent);
  EXPECT_FALSE(start.may_begin());
}

TEST(UnseenStart, WhileItsTriggerMayBeWithTheBusNoRestEndsIt) {
  Start a;
  EXPECT_EQ(a.start.base(), 100);
  EXPECT_FALSE(a.look(sent + 1h));
  EXPECT_EQ(a.start.state(), State::sending);
}

TEST(UnseenStart, ADriveMayBeginUntilTheStartWindowIsOver) {
  Start a;
  a.start.sent(a.number, sent);
  EXPECT_EQ(a.start.state(), State::unseen);
  EXPECT_FALSE(a.look(window_end - 1ms));
  EXPECT_TRUE(a.start.may_begin());
  EXPECT_FALSE(a.look(window_end)) << "it has not begun";
  EXPECT_FALSE(a.start.may_begin());
}

TEST(UnseenStart, AMotionIsToldOnce) {
  Start a;
  a.start.sent(a.number, sent);
  EXPECT_TRUE(a.look(sent + 80ms, true, true));
  EXPECT_FALSE(a.start.may_begin());
  EXPECT_FALSE(a.look(sent + 90ms, true, true));
}

TEST(UnseenStart, AMotionMayShowBeforeItsReplyDoes) {
  Start a;
  EXPECT_TRUE(a.look(sent, true));
  a.start.sent(a.number, sent);
  EXPECT_FALSE(a.start.may_begin());
}

TEST(UnseenStart, WhatWasReadBeforeItsTriggerSaysNothingOfIt) {
  Start a;
  EXPECT_FALSE(a.look(sent - 1ms, true, true));
  EXPECT_TRUE(a.start.may_begin());
  EXPECT_EQ(a.start.begun(), 0);
  EXPECT_TRUE(a.look(sent, true));
  EXPECT_EQ(a.start.begun(), 1);
}

TEST(UnseenStart, WhoRestsElsewhereHasBegunAndEnded) {
  Start a;
  a.start.sent(a.number, sent);
  EXPECT_FALSE(a.look(sent + 5ms, false, true));
  EXPECT_FALSE(a.start.may_begin());
}

TEST(UnseenStart, WhatWasNotSentDoesNotBegin) {
  Start a;
  a.start.left(sent);
  EXPECT_TRUE(a.start.may_begin()) << "nobody has told yet";
  a.start.not_sent(a.number);
  EXPECT_FALSE(a.start.may_begin());
}

TEST(UnseenStart, ALateAnswerDoesNotPutItOff) {
  Start a;
  a.start.left(sent);
  a.start.sent(a.number, sent + 400ms);
  EXPECT_FALSE(a.look(window_end));
  EXPECT_FALSE(a.start.may_begin()) << "the gate was closed at the former time";
}

TEST(UnseenStart, WhatBecameOfOneBeforeSaysNothingOfTheNewest) {
  Start a;
  const auto newest = a.start.sending(200, sent);
  a.start.not_sent(a.number);
  a.start.sent(a.number, sent);
  EXPECT_EQ(a.start.state(), State::sending);
  EXPECT_EQ(a.start.base(), 200);
  a.start.sent(newest, sent);
  EXPECT_EQ(a.start.state(), State::unseen);
}

TEST(UnseenStart, ARestartedDriveHasForgottenIt) {
  Start a;
  a.start.sent(a.number, sent);
  a.start.restarted();
  EXPECT_FALSE(a.start.may_begin());
}

}  // namespace
}  // namespace axisd
