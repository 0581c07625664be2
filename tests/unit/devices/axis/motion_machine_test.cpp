#include "devices/axis/motion_machine.hpp"

#include <gtest/gtest.h>

namespace axisd {
namespace {

using namespace std::chrono_literals;
using State = MotionMachine::State;

constexpr TimePoint started{10s};
constexpr auto predicted = 400ms;
constexpr auto settling = 300ms;

MotionMachine::Motion motion() { return {.since = started, .predicted = predicted, .settling = settling}; }

/// Readings by the time since the start.
struct Followed {
  explicit Followed(const MotionMachine::Motion& how = motion()) : machine(how) {}
  State moves(Duration at) {
    return machine.look({.asked_at = started + at, .moving = true, .elsewhere = true});
  }
  State rests(Duration at, MotionMachine::Reading reading = {}) {
    reading.asked_at = started + at;
    return machine.look(reading);
  }
  State arrives(Duration at) {
    return rests(at, {.elsewhere = true, .at_target = true, .in_position = true});
  }

  MotionMachine machine;
};

TEST(MotionMachine, WhatWasReadBeforeTheStartCountsForNothing) {
  Followed followed;
  EXPECT_EQ(followed.moves(-1ms), State::starting);
  EXPECT_EQ(followed.moves(0ms), State::running);
}

TEST(MotionMachine, AMotionBeginsWhenItIsSeen) {
  Followed by_motion, by_place;
  EXPECT_EQ(by_motion.rests(10ms), State::starting);
  EXPECT_EQ(by_motion.machine.look({.asked_at = started + 20ms, .moving = true}), State::running);
  EXPECT_EQ(by_place.rests(10ms, {.elsewhere = true}), State::settling) << "it has begun, and rests already";
}

TEST(MotionMachine, ItArrivesAtRestAtItsTarget) {
  Followed followed;
  followed.moves(10ms);
  EXPECT_EQ(followed.machine.look({.asked_at = started + 20ms, .moving = true, .at_target = true}),
            State::running)
      << "it still moves";
  EXPECT_EQ(followed.arrives(30ms), State::arrived);
  EXPECT_EQ(followed.moves(40ms), State::arrived) << "until it is looked at again";
}

TEST(MotionMachine, RestAtTheTargetBeforeItBeganIsNoArrival) {
  Followed followed;
  EXPECT_EQ(followed.rests(10ms, {.at_target = true}), State::starting);
}

TEST(MotionMachine, ItSettlesBeforeItArrives) {
  Followed followed;
  followed.moves(10ms);
  EXPECT_EQ(followed.rests(20ms), State::settling);
  EXPECT_EQ(followed.rests(20ms + settling - 1ms), State::settling);
  EXPECT_EQ(followed.arrives(20ms + settling), State::settling);
  EXPECT_EQ(followed.arrives(20ms + settling + MotionMachine::still), State::arrived);
}

/// It crosses its target, and is in position as its drive says at that moment.
TEST(MotionMachine, AShaftThatRingsHasNotArrived) {
  Followed followed;
  followed.moves(10ms);
  EXPECT_EQ(followed.rests(20ms), State::settling);
  for (auto at = 30ms; at < 600ms; at += 30ms) {
    EXPECT_EQ(followed.arrives(at), State::settling) << at.count();
    EXPECT_EQ(followed.arrives(at + MotionMachine::still - 1ms), State::settling) << at.count();
    EXPECT_EQ(followed.rests(at + MotionMachine::still), State::settling) << at.count();
  }
  EXPECT_EQ(followed.arrives(610ms), State::settling);
  EXPECT_EQ(followed.arrives(620ms), State::settling);
  EXPECT_EQ(followed.arrives(630ms), State::arrived);
}

TEST(MotionMachine, WhereItsDriveDoesNotSayThatItIsInPositionItIsReadThereForAWhile) {
  Followed followed;
  const MotionMachine::Reading there{.elsewhere = true, .at_target = true};
  followed.moves(10ms);
  EXPECT_EQ(followed.rests(20ms, there), State::settling);
  EXPECT_EQ(followed.rests(39ms, there), State::settling);
  EXPECT_EQ(followed.rests(40ms, there), State::arrived);
}

TEST(MotionMachine, WhatWaversAtTheEdgeOfItsWindowHasArrived) {
  Followed followed;
  const MotionMachine::Reading beside{.elsewhere = true, .near_target = true};
  followed.moves(10ms);
  EXPECT_EQ(followed.rests(20ms, beside), State::settling);
  EXPECT_EQ(followed.arrives(30ms), State::settling);
  EXPECT_EQ(followed.rests(40ms, beside), State::settling);
  EXPECT_EQ(followed.rests(50ms, beside), State::settling) << "it is not there";
  EXPECT_EQ(followed.arrives(60ms), State::arrived);
}

/// A brief motion is over before it is read: its shaft rings when it is seen for the first time.
TEST(MotionMachine, WhatRingsBeforeItIsKnownToHaveBegunHasNotArrived) {
  Followed followed;
  EXPECT_EQ(followed.rests(30ms, {.beside = true}), State::starting);
  EXPECT_EQ(followed.arrives(40ms), State::settling) << "it crosses its target";
  EXPECT_EQ(followed.arrives(60ms), State::arrived);

  Followed moved;
  EXPECT_EQ(moved.rests(30ms, {.beside = true}), State::starting) << "the motion before settles";
  moved.moves(40ms);
  EXPECT_EQ(moved.arrives(50ms), State::arrived);
}

/// On a full line a reading comes a second after the one before.
TEST(MotionMachine, WhatIsReadSeldomArrivesAllTheSame) {
  const MotionMachine::Motion brief{.since = started, .predicted = 200ms, .settling = settling};
  Followed lags(brief);  // 1.25 times what was predicted, and a second
  lags.moves(10ms);
  EXPECT_EQ(lags.rests(210ms, {.elsewhere = true}), State::settling);
  EXPECT_EQ(lags.arrives(1510ms), State::settling);
  EXPECT_EQ(lags.arrives(2510ms), State::arrived);

  Followed late(brief);
  EXPECT_EQ(late.rests(1260ms, {.elsewhere = true, .at_target = true}), State::settling);
  EXPECT_EQ(late.moves(2260ms), State::took_too_long) << "the next reading decides";

  Followed wavers(brief);
  wavers.moves(10ms);
  EXPECT_EQ(wavers.rests(210ms, {.elsewhere = true, .at_target = true, .near_target = true}),
            State::settling);
  EXPECT_EQ(wavers.rests(560ms, {.elsewhere = true, .near_target = true}), State::settling);
  EXPECT_EQ(wavers.rests(1210ms, {.elsewhere = true, .at_target = true, .near_target = true}),
            State::arrived);

  Followed beside({.since = started, .predicted = 60s, .settling = settling});
  beside.moves(10ms);
  beside.rests(210ms, {.elsewhere = true, .at_target = true, .near_target = true});
  EXPECT_EQ(beside.rests(2200ms, {.elsewhere = true, .near_target = true}), State::settling);
  EXPECT_EQ(beside.rests(2220ms, {.elsewhere = true, .near_target = true}), State::rests_elsewhere);
}

TEST(MotionMachine, AMotionInBetweenBreaksItsRestAtTheTarget) {
  Followed followed;
  followed.moves(10ms);
  followed.rests(20ms);
  EXPECT_EQ(followed.arrives(30ms), State::settling);
  EXPECT_EQ(followed.moves(40ms), State::running);
  EXPECT_EQ(followed.rests(50ms), State::settling);
  EXPECT_EQ(followed.arrives(60ms), State::settling);
}

TEST(MotionMachine, AShaftThatLeavesItsTargetForLongerThanItSettlesRestsElsewhere) {
  Followed followed;
  followed.moves(10ms);
  followed.rests(20ms);
  EXPECT_EQ(followed.arrives(300ms), State::settling);
  EXPECT_EQ(followed.rests(300ms + settling - 1ms), State::settling);
  EXPECT_EQ(followed.rests(300ms + settling), State::rests_elsewhere);
}

TEST(MotionMachine, AMotionBetweenTwoRestsSettlesAnew) {
  Followed followed;
  followed.moves(10ms);
  EXPECT_EQ(followed.rests(20ms), State::settling);
  EXPECT_EQ(followed.moves(250ms), State::running);
  EXPECT_EQ(followed.rests(400ms), State::settling);
  EXPECT_EQ(followed.rests(690ms), State::settling);
}

TEST(MotionMachine, RestElsewhereForLongerThanAShaftSettlesEndsIt) {
  Followed followed;
  followed.moves(10ms);
  followed.rests(20ms);
  EXPECT_EQ(followed.rests(20ms + settling), State::rests_elsewhere);
}

TEST(MotionMachine, WhatATerminalHoldsBackDoesNotSettle) {
  Followed followed;
  followed.moves(10ms);
  EXPECT_EQ(followed.rests(20ms, {.held_back = true}), State::rests_elsewhere);
}

TEST(MotionMachine, WhatRestedBeforeItBeganHasNotSettledYet) {
  Followed followed;
  followed.rests(10ms);
  EXPECT_EQ(followed.rests(400ms, {.elsewhere = true}), State::settling);
}

TEST(MotionMachine, AMotionThatNoReadingCanShowHasBegunWhenItsTimeIsOver) {
  auto unseen = motion();
  unseen.unseen = true;
  Followed followed(unseen);
  EXPECT_EQ(followed.rests(10ms, {.at_target = true}), State::starting);
  EXPECT_EQ(followed.rests(predicted + 99ms, {.at_target = true}), State::starting);
  EXPECT_EQ(followed.rests(predicted + 100ms, {.at_target = true, .in_position = true}), State::arrived);
}

/// Some drives begin late, and a way within the window looks the same before and after.
TEST(MotionMachine, AMotionThatNoReadingCanShowMayBeginUntilTheStartWindowIsOver) {
  auto unseen = motion();
  unseen.unseen = true;
  unseen.predicted = 20ms;
  const MotionMachine::Reading there{.at_target = true, .in_position = true};
  Followed late(unseen), seen(unseen);
  EXPECT_EQ(late.rests(120ms, there), State::starting);
  EXPECT_EQ(late.rests(start_window - 1ms, there), State::starting);
  EXPECT_EQ(late.rests(start_window, there), State::arrived);
  EXPECT_EQ(seen.machine.look({.asked_at = started + 10ms, .moving = true}), State::running);
  EXPECT_EQ(seen.rests(20ms, there), State::arrived) << "nothing else can come";
}

TEST(MotionMachine, AMotionThatNoReadingCanShowHasNotBegunWhereATerminalHoldsItBack) {
  auto unseen = motion();
  unseen.unseen = true;
  Followed followed(unseen);
  EXPECT_EQ(followed.rests(predicted + 100ms, {.at_target = true, .held_back = true}), State::did_not_start);
}

TEST(MotionMachine, RestByAReadingFromAfterTheStartWindowIsNoStart) {
  Followed followed;
  EXPECT_EQ(followed.rests(start_window - 1ms), State::starting);
  EXPECT_EQ(followed.rests(start_window), State::did_not_start);
}

TEST(MotionMachine, AnotherModeOfTheDriveEndsIt) {
  Followed starting, running;
  EXPECT_EQ(starting.rests(10ms, {.positioning = false}), State::taken_over);
  running.moves(10ms);
  EXPECT_EQ(running.rests(20ms, {.positioning = false, .moving = true}), State::taken_over);
}

TEST(MotionMachine, AnotherModeEndsItWhileItSettles) {
  Followed followed;
  followed.moves(10ms);
  ASSERT_EQ(followed.rests(20ms), State::settling);
  EXPECT_EQ(followed.rests(30ms, {.positioning = false}), State::taken_over);
}

TEST(MotionMachine, ItDoesNotSettleBeyondItsTime) {
  Followed followed;
  const auto latest = predicted + predicted / 4 + 1s;
  followed.moves(latest - 20ms);
  ASSERT_EQ(followed.rests(latest - 1ms), State::settling);
  EXPECT_EQ(followed.rests(latest), State::took_too_long);
}

TEST(MotionMachine, AMotionFarLongerThanPredictedEnds) {
  Followed followed;
  const auto latest = predicted + predicted / 4 + 1s;
  EXPECT_EQ(followed.machine.latest(), started + latest);
  EXPECT_EQ(followed.moves(latest - 1ms), State::running);
  EXPECT_EQ(followed.moves(latest), State::took_too_long);
}

TEST(MotionMachine, AnEndlessMotionTakesAsLongAsItLikes) {
  auto endless = motion();
  endless.endless = true;
  Followed followed(endless);
  EXPECT_EQ(followed.machine.latest(), TimePoint::max());
  EXPECT_EQ(followed.moves(24h), State::running);
}

TEST(MotionMachine, WhatMovedAfterItHadArrivedIsFollowedOn) {
  Followed followed;
  followed.moves(10ms);
  ASSERT_EQ(followed.arrives(20ms), State::arrived);
  followed.machine.go_on();
  EXPECT_EQ(followed.machine.state(), State::running);
  EXPECT_EQ(followed.rests(400ms), State::settling);
  EXPECT_EQ(followed.arrives(600ms), State::settling);
  EXPECT_EQ(followed.arrives(620ms), State::arrived);
}

using Readback = StartReadback::State;

Readback read(StartReadback& readback, Duration at, bool shows_it) {
  return readback.look(StartReadback::Reading{.asked_at = started + at, .shows_it = shows_it},
                       started + at + 5ms);
}

TEST(StartReadback, WhatMovesWasExecuted) {
  StartReadback readback(started);
  EXPECT_EQ(readback.look(std::nullopt, started + 1ms), Readback::reading);
  EXPECT_EQ(read(readback, -1ms, true), Readback::reading) << "that was before the trigger";
  EXPECT_EQ(read(readback, 10ms, false), Readback::reading);
  EXPECT_EQ(read(readback, 20ms, true), Readback::executed);
  EXPECT_EQ(readback.superseded(), Readback::unresolved);
}

TEST(StartReadback, WhatRestsAfterTheStartWindowWasNotExecutedIfThatWouldShow) {
  StartReadback readback(started);
  EXPECT_EQ(read(readback, start_window - 1ms, false), Readback::reading);
  EXPECT_EQ(readback.proven(true), Readback::reading) << "there is nothing to be proven yet";
  EXPECT_EQ(read(readback, start_window, false), Readback::resting);
  EXPECT_EQ(readback.proven(true), Readback::not_executed);
}

TEST(StartReadback, WhatWouldNotShowIsUnresolved) {
  StartReadback readback(started);
  read(readback, start_window, false);
  EXPECT_EQ(readback.proven(false), Readback::unresolved);
}

TEST(StartReadback, WhatIsSupersededOrNotProvenIsUnresolved) {
  StartReadback reading(started), resting(started);
  EXPECT_EQ(reading.superseded(), Readback::unresolved);
  read(resting, start_window, false);
  EXPECT_EQ(resting.superseded(), Readback::unresolved);
}

TEST(MotionMachine, WhatMovesAwayFromItsTargetIsAnotherMotion) {
  Followed starting, running, resting;
  const auto astray = [](Followed& followed, bool moving) {
    return followed.machine.look(
        {.asked_at = started + 20ms, .moving = moving, .elsewhere = true, .astray = true});
  };
  EXPECT_EQ(astray(starting, true), State::astray);
  running.moves(10ms);
  EXPECT_EQ(astray(running, true), State::astray);
  resting.moves(10ms);
  EXPECT_EQ(astray(resting, false), State::settling) << "its rest decides";
}

}  // namespace
}  // namespace axisd
