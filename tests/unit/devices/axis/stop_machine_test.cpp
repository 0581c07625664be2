#include "devices/axis/stop_machine.hpp"

#include <gtest/gtest.h>

#include "tests/support/virtual_world.hpp"

namespace axisd {
namespace {

using namespace std::chrono_literals;
using State = StopMachine::State;
using Debt = StopMachine::Debt;
using Step = StopMachine::Step;
using Answer = StopMachine::Answer;
using Shown = StopMachine::Shown;

class StopMachineTest : public testing::Test {
 protected:
  void begin(StopKind kind) {
    stop_.ask(kind);
    (void)stop_.begin();
  }
  /// A frame of the next attempt, which the drive acknowledges.
  StopKind send() {
    const auto kind = stop_.next_attempt();
    EXPECT_EQ(stop_.sent(Answer::acknowledged, false), Step::look);
    return kind;
  }
  Step looked(bool rests, bool may_release = false) {
    return stop_.looked(rests ? RestVerdict::rests : RestVerdict::moves, false, may_release);
  }
  CommandPtr command(std::string client = {}) {
    return std::make_shared<CommandRecord>(Command{.client = std::move(client)}, world_.clock());
  }

  test::VirtualWorld world_;
  AxisGate gate_;
  StopHolds holds_;
  StopMachine stop_{gate_, &holds_};
};

// What is under way

TEST_F(StopMachineTest, TheFirstStopBeginsASequenceAndTheNextJoinsIt) {
  stop_.ask(StopKind::halt);
  EXPECT_FALSE(stop_.under_way());
  EXPECT_TRUE(stop_.begin());
  EXPECT_EQ(stop_.state(), State::sending);
  stop_.ask(StopKind::stop);
  EXPECT_FALSE(stop_.begin());
  EXPECT_EQ(stop_.next_attempt(), StopKind::stop) << "the strongest that was asked for";
}

TEST_F(StopMachineTest, OfOneClientsStopsTheNewestWait) {
  constexpr auto most = std::size_t{StopMachine::most_of_one_client};
  begin(StopKind::stop);
  const auto other = command("b");
  EXPECT_EQ(stop_.serve(other), nullptr);
  std::vector<CommandPtr> mine;
  for (std::size_t i = 0; i < most + 10; ++i) {
    mine.push_back(command("a"));
    EXPECT_EQ(stop_.serve(mine.back()), i < most ? nullptr : mine[i - most]) << i;
  }
  send();
  EXPECT_EQ(looked(true), Step::rests);
  const auto confirmed = stop_.confirmed();
  ASSERT_EQ(confirmed.size(), most + 1);
  EXPECT_EQ(confirmed.front(), other) << "that of another is none of its business";
  EXPECT_EQ(confirmed.back(), mine.back());
  // Nothing of before counts any more.
  begin(StopKind::stop);
  for (std::size_t i = 0; i < most; ++i) EXPECT_EQ(stop_.serve(command("a")), nullptr);
}

TEST_F(StopMachineTest, AWeakerStopDoesNotWeakenAStrongerOne) {
  begin(StopKind::quick_stop);
  begin(StopKind::halt);
  EXPECT_EQ(stop_.next_attempt(), StopKind::quick_stop);
}

TEST_F(StopMachineTest, AnAcknowledgedStopIsLookedAfter) {
  begin(StopKind::stop);
  send();
  EXPECT_EQ(stop_.state(), State::confirming);
}

TEST_F(StopMachineTest, ARefusedStopIsLookedAfter) {
  begin(StopKind::stop);
  stop_.next_attempt();
  EXPECT_EQ(stop_.sent(Answer::refused, false), Step::look);
  EXPECT_EQ(stop_.state(), State::confirming);
}

TEST_F(StopMachineTest, AStopWithoutAReplyIsRepeatedTwiceAndThenLookedAfter) {
  begin(StopKind::stop);
  for (int again = 1; again < StopMachine::attempts; ++again) {
    stop_.next_attempt();
    EXPECT_EQ(stop_.sent(Answer::no_reply, false), Step::send);
    EXPECT_EQ(stop_.state(), State::sending);
  }
  stop_.next_attempt();
  EXPECT_EQ(stop_.sent(Answer::no_reply, false), Step::look);
  EXPECT_EQ(stop_.state(), State::confirming);
}

TEST_F(StopMachineTest, WhatMovesThoughNoStopMayHaveArrivedIsStoppedAgain) {
  begin(StopKind::stop);
  for (int round = 0; round < 10; ++round) {
    for (int attempt = 0; attempt < StopMachine::attempts; ++attempt) {
      EXPECT_EQ(stop_.next_attempt(), StopKind::stop) << "no stronger one";
      stop_.sent(Answer::no_reply, false);
    }
    EXPECT_EQ(stop_.looked(RestVerdict::undecided, false, true), Step::send);
    EXPECT_EQ(stop_.state(), State::sending);
  }
}

TEST_F(StopMachineTest, AStopThatCannotBeSentFails) {
  begin(StopKind::stop);
  stop_.next_attempt();
  EXPECT_EQ(stop_.sent(Answer::failed, false), Step::unreachable);
  begin(StopKind::stop);
  stop_.next_attempt();
  EXPECT_EQ(stop_.sent(Answer::no_reply, true), Step::unreachable);
}

TEST_F(StopMachineTest, AStopAskedForWhileOneCouldNotBeSentIsSent) {
  begin(StopKind::stop);
  stop_.next_attempt();
  begin(StopKind::stop);
  EXPECT_EQ(stop_.sent(Answer::failed, true), Step::send);
  EXPECT_EQ(stop_.state(), State::sending);
}

TEST_F(StopMachineTest, AStopAskedForWhileAnotherIsConfirmedIsSent) {
  begin(StopKind::stop);
  send();
  EXPECT_FALSE(stop_.overtaken());
  begin(StopKind::stop);
  EXPECT_TRUE(stop_.overtaken());
  EXPECT_EQ(looked(true), Step::send) << "though it rests";
  EXPECT_EQ(stop_.state(), State::sending);
}

TEST_F(StopMachineTest, StandstillEndsIt) {
  begin(StopKind::stop);
  const auto first = command(), second = command();
  (void)stop_.serve(first);
  (void)stop_.serve(second);
  send();
  EXPECT_EQ(looked(true), Step::rests);
  EXPECT_TRUE(stop_.under_way()) << "until the sequence has ended";
  EXPECT_EQ(stop_.confirmed(), (std::vector{first, second}));
  EXPECT_EQ(stop_.state(), State::none);
  EXPECT_EQ(stop_.last(), second);
  EXPECT_EQ(stop_.failures(), 0U);
  EXPECT_TRUE(stop_.confirmed().empty()) << "its commands end once";
}

TEST_F(StopMachineTest, StandstillThatNoStopWasAcknowledgedBeforeIsStoppedAgain) {
  begin(StopKind::stop);
  for (int round = 1;; ++round) {
    for (int attempt = 1; attempt < StopMachine::attempts; ++attempt) {
      stop_.next_attempt();
      ASSERT_EQ(stop_.sent(Answer::no_reply, false), Step::send);
    }
    stop_.next_attempt();
    ASSERT_EQ(stop_.sent(Answer::no_reply, false), Step::look);
    if (round == StopMachine::unacknowledged_rounds) break;
    EXPECT_EQ(looked(true), Step::send);
    EXPECT_EQ(stop_.state(), State::sending);
  }
  EXPECT_EQ(looked(true), Step::rests) << "this drive does not acknowledge";
}

TEST_F(StopMachineTest, WhatMovesOnIsStoppedQuickly) {
  begin(StopKind::halt);
  send();
  EXPECT_EQ(stop_.patience(100ms, 50ms), 2100ms);
  EXPECT_EQ(looked(false, true), Step::quicken);
  EXPECT_EQ(stop_.state(), State::sending);
  EXPECT_EQ(send(), StopKind::quick_stop);
  EXPECT_EQ(stop_.patience(100ms, 0ms), 100ms) << "it has no ramp";
  EXPECT_EQ(stop_.patience(100ms, 50ms), 150ms) << "it has one of its own";
}

TEST_F(StopMachineTest, WhatMovesAfterAQuickStopIsReleasedOnceWhereThatIsPermitted) {
  begin(StopKind::quick_stop);
  send();
  EXPECT_EQ(looked(false, true), Step::release);
  EXPECT_EQ(stop_.state(), State::releasing);
  EXPECT_EQ(send(), StopKind::quick_stop);
  EXPECT_EQ(stop_.state(), State::confirming);
  EXPECT_EQ(looked(false, true), Step::not_confirmed);
}

TEST_F(StopMachineTest, WhatMovesAfterAQuickStopFailsWhereNoReleaseIsPermitted) {
  begin(StopKind::quick_stop);
  send();
  EXPECT_EQ(looked(false), Step::not_confirmed);
  EXPECT_EQ(stop_.failures(), 0U);
  stop_.failed();
  EXPECT_EQ(stop_.state(), State::none);
  EXPECT_EQ(stop_.failures(), 1U);
}

TEST_F(StopMachineTest, ADriveThatFallsSilentIsNotEscalated) {
  begin(StopKind::stop);
  send();
  EXPECT_EQ(stop_.looked(RestVerdict::moves, true, true), Step::fell_silent);
}

TEST_F(StopMachineTest, EachSequenceEscalatesAnew) {
  begin(StopKind::quick_stop);
  send();
  EXPECT_EQ(looked(false, true), Step::release);
  stop_.failed();
  begin(StopKind::halt);
  EXPECT_EQ(send(), StopKind::halt);
  EXPECT_EQ(looked(false, true), Step::quicken);
  send();
  EXPECT_EQ(looked(false, true), Step::release);
}

// What is owed

TEST_F(StopMachineTest, WhatACommandLeftRunningIsThereUntilAStopIsConfirmed) {
  stop_.leave_running();
  EXPECT_EQ(stop_.debt(), Debt::motion);
  EXPECT_TRUE(stop_.left_running());
  EXPECT_FALSE(stop_.owed());
  stop_.confirmed();
  EXPECT_EQ(stop_.debt(), Debt::none);
}

TEST_F(StopMachineTest, AStopIsOwedUntilOneIsConfirmed) {
  stop_.owe();
  EXPECT_EQ(stop_.debt(), Debt::stop);
  EXPECT_TRUE(stop_.owed());
  EXPECT_FALSE(stop_.left_running());
  stop_.pay();
  EXPECT_EQ(stop_.debt(), Debt::none);
}

TEST_F(StopMachineTest, AMotionMayBecomeOwedAndAnOwedStopMayBeThatOfAMotion) {
  stop_.leave_running();
  stop_.owe();
  EXPECT_EQ(stop_.debt(), Debt::stop_of_motion);
  stop_.pay();
  stop_.owe();
  stop_.leave_running();
  EXPECT_EQ(stop_.debt(), Debt::stop_of_motion);
  EXPECT_TRUE(stop_.owed() && stop_.left_running());
}

TEST_F(StopMachineTest, AFailedStopIsOwed) {
  begin(StopKind::stop);
  stop_.failed();
  EXPECT_EQ(stop_.debt(), Debt::stop);
  stop_.pay();
  stop_.leave_running();
  begin(StopKind::stop);
  stop_.failed();
  EXPECT_EQ(stop_.debt(), Debt::stop_of_motion);
}

TEST_F(StopMachineTest, ARestartEndsTheMotionAndNotTheDebt) {
  stop_.leave_running();
  stop_.restarted();
  EXPECT_EQ(stop_.debt(), Debt::none);
  stop_.leave_running();
  stop_.owe();
  stop_.restarted();
  EXPECT_EQ(stop_.debt(), Debt::stop);
}

TEST_F(StopMachineTest, AReadingAtRestPaysUnlessAStopIsUnderWay) {
  stop_.owe();
  stop_.seen_at_rest();
  EXPECT_EQ(stop_.debt(), Debt::none);
  stop_.owe();
  begin(StopKind::stop);
  stop_.seen_at_rest();
  EXPECT_EQ(stop_.debt(), Debt::stop) << "that reading may be older than the stop";
}

// What is coming

TEST_F(StopMachineTest, AStopIsComingFromItsRequestToItsEnd) {
  EXPECT_FALSE(stop_.coming());
  gate_.request_stop();
  EXPECT_TRUE(stop_.coming());
  EXPECT_TRUE(stop_.forbids_motion());
  EXPECT_FALSE(stop_.under_way());
  gate_.stop_served();
  begin(StopKind::stop);
  EXPECT_TRUE(stop_.coming());
  EXPECT_TRUE(stop_.forbids_motion());
  stop_.confirmed();
  EXPECT_FALSE(stop_.coming());
  EXPECT_FALSE(stop_.forbids_motion());
}

TEST_F(StopMachineTest, AHaltForbidsNoMotionAndShowsTheOneThatItEnds) {
  stop_.found_in_motion();
  EXPECT_EQ(stop_.shown(), Shown::nothing);
  begin(StopKind::halt);
  EXPECT_EQ(stop_.shown(), Shown::ended_motion);
  EXPECT_FALSE(stop_.stops());
  EXPECT_FALSE(stop_.forbids_motion());
  begin(StopKind::stop);
  EXPECT_TRUE(stop_.stops());
  EXPECT_EQ(stop_.shown(), Shown::stopping);
  stop_.confirmed();
  begin(StopKind::halt);
  EXPECT_EQ(stop_.shown(), Shown::nothing) << "this one found it at rest";
}

TEST_F(StopMachineTest, ItIsHeldWhileSomebodyHolds) {
  EXPECT_FALSE(stop_.held());
  const auto hold = holds_.add({.holder = "hmi", .request_id = {}}, {}, {});
  EXPECT_TRUE(stop_.held());
  EXPECT_EQ(stop_.shown(), Shown::stopping);
  EXPECT_TRUE(holds_.end(hold));
  EXPECT_FALSE(stop_.held());
  EXPECT_FALSE(StopMachine(gate_, nullptr).held());
}

TEST_F(StopMachineTest, RequestsThatArrivedBeforeAStopAreOvertaken) {
  stop_.arrived(TimePoint{5s});
  stop_.arrived(TimePoint{3s});
  EXPECT_TRUE(stop_.overtook(TimePoint{4s}));
  EXPECT_FALSE(stop_.overtook(TimePoint{5s}));
  EXPECT_FALSE(stop_.overtook({})) << "those of the daemon itself have no time";
}

TEST_F(StopMachineTest, TheDecelerationIsThatOfTheLastMotion) {
  EXPECT_EQ(stop_.deceleration(), 2s);
  stop_.set_deceleration(300ms);
  begin(StopKind::stop);
  stop_.next_attempt();
  EXPECT_EQ(stop_.patience(200ms, 0ms), 500ms);
}

}  // namespace
}  // namespace axisd
