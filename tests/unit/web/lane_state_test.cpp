#include "api/web/gateway/lane_state.hpp"

#include "axisd/v1/lease_service.pb.h"
#include "tests/unit/web/lane_test.hpp"

namespace axisd::web {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// One test for each arrow.

TEST_F(LaneTest, AJogStarts) {
  jog();
  EXPECT_EQ(feeder(), Jogging::starting);
  EXPECT_THAT(taken(), ElementsAre("Jog"));
}

TEST_F(LaneTest, AnAnswerSaysThatItRuns) {
  jog();
  answer(0);
  EXPECT_EQ(feeder(), Jogging::running);
}

TEST_F(LaneTest, NobodyKnowsWhetherItRunsWhereTheAnswerIsLost) {
  for (const int lost :
       {code::unavailable, code::deadline_exceeded, code::cancelled, code::internal, code::unknown}) {
    press = "press-" + std::to_string(lost);
    jog();
    fail(numbers.size() - 1, lost);
    EXPECT_EQ(feeder(), Jogging::running);
    (void)taken();
    wait(300ms);
    EXPECT_THAT(taken(), ElementsAre("Halt"));
    wait(LaneState::pause);
    EXPECT_THAT(taken(), ElementsAre("Halt")) << "behind whatever still came";
    for (const auto back : {1, 2}) answer(numbers.size() - static_cast<std::size_t>(back));
  }
}

TEST_F(LaneTest, WhatTheDaemonItselfSaysIsKnown) {
  jog();
  fail(0, code::unavailable, "details");  // the drive is offline
  EXPECT_EQ(feeder(), Jogging::none);
}

TEST_F(LaneTest, WhatHasNotLeftTheGatewayNeedsNoHalt) {
  jog();
  note(lane.answered(numbers.at(0), {.code = code::unavailable, .not_sent = true}, {}, now));
  EXPECT_EQ(feeder(), Jogging::none);
  (void)taken();
  wait(1s);
  EXPECT_THAT(taken(), IsEmpty());
}

TEST_F(LaneTest, AStopBehindALostAnswerIsFollowedByAHalt) {
  jog();
  fail(0, code::cancelled);
  (void)taken();
  stop();
  EXPECT_THAT(taken(), ElementsAre("Halt"));
  EXPECT_EQ(feeder(), Jogging::none);
  wait(LaneState::pause);
  EXPECT_THAT(taken(), ElementsAre("Halt"));
}

TEST_F(LaneTest, AnAnswerThatIsLostBehindAStopIsFollowedByAHalt) {
  jog();
  stop();
  (void)taken();
  fail(0, code::cancelled);
  EXPECT_THAT(taken(), ElementsAre("answer"));
  wait(LaneState::pause);
  EXPECT_THAT(taken(), ElementsAre("Halt"));
}

TEST_F(LaneTest, ARenewalKeepsItRunning) {
  run();
  for (int i = 0; i < 20; ++i) {
    wait(200ms);
    jog();
    answer(numbers.size() - 1);
  }
  EXPECT_EQ(feeder(), Jogging::running);
  EXPECT_THAT(taken(), testing::Not(testing::Contains("Halt")));
}

TEST_F(LaneTest, AStartThatIsRefusedIsNone) {
  jog();
  fail(0, 9);
  EXPECT_EQ(feeder(), Jogging::none);
  (void)taken();
  close();
  EXPECT_THAT(taken(), IsEmpty());
}

TEST_F(LaneTest, ARenewalThatIsRefusedEndsNothing) {
  run();
  jog();
  fail(1, code::resource_exhausted);
  EXPECT_EQ(feeder(), Jogging::running);
  jog();
  answer(2);
  (void)taken();
  jog();
  fail(3, code::failed_precondition, "details");
  (void)taken();
  close();
  EXPECT_THAT(taken(), ElementsAre("Halt"));
}

TEST_F(LaneTest, AStartThatHasEndedIsNone) {
  jog();
  answer(0, v1::COMMAND_STATE_ABORTED);
  EXPECT_EQ(feeder(), Jogging::none);
}

TEST_F(LaneTest, AJogThatHasEndedByItselfIsNotHalted) {
  run();
  jog();
  answer(1, v1::COMMAND_STATE_DONE);  // at its limit, say
  EXPECT_EQ(feeder(), Jogging::none);
  (void)taken();
  wait(1s);
  EXPECT_THAT(taken(), IsEmpty()) << "somebody else may move it by now";
}

TEST_F(LaneTest, SilenceHaltsWhatStarts) {
  jog();
  (void)taken();
  wait(299ms);
  EXPECT_THAT(taken(), IsEmpty());
  wait(1ms);
  EXPECT_THAT(taken(), ElementsAre("Halt"));
  EXPECT_EQ(feeder(), Jogging::ending);
}

TEST_F(LaneTest, SilenceHaltsWhatRuns) {
  run();
  wait(300ms);
  EXPECT_THAT(taken(), ElementsAre("Halt"));
  EXPECT_EQ(feeder(), Jogging::none);
}

TEST_F(LaneTest, SilenceHaltsWhatRunsAndIsBeingRenewed) {
  run();
  jog();
  (void)taken();
  wait(300ms);
  EXPECT_THAT(taken(), ElementsAre("Halt"));
  EXPECT_EQ(feeder(), Jogging::ending);
}

TEST_F(LaneTest, CloseHaltsWhatStartsAndOnceMoreBehindItsAnswer) {
  jog();
  (void)taken();
  close();
  EXPECT_THAT(taken(), ElementsAre("Halt"));
  EXPECT_EQ(feeder(), Jogging::ending);
  answer(1, v1::COMMAND_STATE_DONE);  // of the halt
  EXPECT_FALSE(lane.at_rest());
  answer(0);
  EXPECT_THAT(taken(), ElementsAre("Halt"));
  EXPECT_EQ(feeder(), Jogging::none);
  answer(2);
  EXPECT_TRUE(lane.at_rest());
}

TEST_F(LaneTest, CloseHaltsWhatRuns) {
  run();
  close();
  EXPECT_THAT(taken(), ElementsAre("Halt"));
  EXPECT_EQ(feeder(), Jogging::none);
  answer(1);
  EXPECT_TRUE(lane.at_rest());
}

TEST_F(LaneTest, AStopOfThePageEndsWhatRuns) {
  for (const auto* kind : {"Halt", "Stop", "QuickStop"}) {
    jog();
    answer(numbers.size() - 1);
    (void)taken();
    stop(kind);
    EXPECT_THAT(taken(), ElementsAre(kind));
    EXPECT_EQ(feeder(), Jogging::none);
  }
}

TEST_F(LaneTest, AStopOfThePageIsFollowedByAHaltBehindTheStartsAnswer) {
  jog();
  stop();
  EXPECT_EQ(feeder(), Jogging::ending);
  answer(1);
  (void)taken();
  answer(0);
  EXPECT_THAT(taken(), ElementsAre("answer", "Halt"));
  EXPECT_EQ(feeder(), Jogging::none);
}

TEST_F(LaneTest, NothingFollowsAnAnswerThatSaysThatNothingRuns) {
  jog();
  stop();
  (void)taken();
  answer(0, v1::COMMAND_STATE_ABORTED);
  EXPECT_THAT(taken(), ElementsAre("answer"));
  EXPECT_EQ(feeder(), Jogging::none);
}

TEST_F(LaneTest, TheLastOfSeveralAnswersIsWaitedFor) {
  jog();
  jog();
  close();
  (void)taken();
  answer(0);
  EXPECT_THAT(taken(), IsEmpty());
  answer(1, v1::COMMAND_STATE_ABORTED);
  EXPECT_THAT(taken(), ElementsAre("Halt")) << "the first of them has not said that it had ended";
}

TEST_F(LaneTest, ANewPressTakesThePlaceOfAnEnd) {
  jog();
  stop();
  jog();
  EXPECT_EQ(feeder(), Jogging::starting);
  (void)taken();
  answer(0, v1::COMMAND_STATE_ABORTED);
  EXPECT_EQ(feeder(), Jogging::starting);
  answer(2);
  EXPECT_EQ(feeder(), Jogging::running);
  EXPECT_THAT(taken(), ElementsAre("answer", "answer")) << "no halt for what is pressed";
  wait(300ms);
  EXPECT_THAT(taken(), ElementsAre("Halt"));
}

// What is sent, and to whom.

TEST_F(LaneTest, HaltsEachAxisByItsName) {
  jog(300ms, {}, "feeder");
  jog(300ms, {}, "lifter");
  close();
  v1::HaltRequest request;
  ASSERT_TRUE(request.ParseFromString(messages.at(2)));
  EXPECT_EQ(request.axis(), "feeder");
  ASSERT_TRUE(request.ParseFromString(messages.at(3)));
  EXPECT_EQ(request.axis(), "lifter");
}

TEST_F(LaneTest, EachJogHasItsOwnHold) {
  jog(100ms, {}, "feeder");
  jog(500ms, {}, "lifter");
  (void)taken();
  wait(100ms);
  EXPECT_THAT(taken(), ElementsAre("Halt"));
  EXPECT_EQ(lane.jogging("lifter"), Jogging::starting);
}

TEST_F(LaneTest, EchoesAndLeasesDoNotBreakTheSilence) {
  run();
  wait(200ms);
  echo();
  say("axisd.v1.LeaseService/RenewLease", v1::RenewLeaseRequest().SerializeAsString());
  EXPECT_THAT(taken(), ElementsAre("echo", "RenewLease"));
  wait(100ms);
  EXPECT_THAT(taken(), ElementsAre("Halt"));
}

TEST_F(LaneTest, AHaltThatFoundNobodyIsTriedAgainForAWhile) {
  run();
  close();
  std::size_t halts = 0;
  do {
    fail(numbers.size() - 1, code::unavailable);
    wait(LaneState::pause);
    ++halts;
  } while (halts < 100 && !lane.at_rest());
  EXPECT_NEAR(static_cast<double>(halts), 20, 2) << "until the daemon has ended the longest hold by itself";
  EXPECT_TRUE(lane.at_rest());
}

TEST_F(LaneTest, AHaltThatFoundNoRoomIsTriedAgain) {
  run();
  close();
  (void)taken();
  fail(1, code::resource_exhausted, "details");
  wait(LaneState::pause);
  EXPECT_THAT(taken(), ElementsAre("Halt"));
}

TEST_F(LaneTest, CallsHaveTheirTime) {
  run();
  stop("Stop");
  jog();
  answer(2);
  close();
  fail(numbers.size() - 1, code::unavailable);
  wait(LaneState::pause);
  EXPECT_THAT(patience,
              ElementsAre(LaneState::patience_of_moves, LaneState::patience_of_stops,
                          LaneState::patience_of_moves, longest_hold, longest_hold - LaneState::pause))
      << "a Halt of the gateway: what is left of it";
}

TEST_F(LaneTest, ANewPressIsNotHaltedByAnOlderHaltThatIsOwed) {
  run();
  wait(300ms);
  fail(1, code::unavailable);
  jog();
  (void)taken();
  wait(200ms);
  EXPECT_THAT(taken(), IsEmpty());
}

TEST_F(LaneTest, LatePressesAndRenewalsAreDropped) {
  echo();
  jog(300ms, 150ms);
  jog(300ms, 152ms);
  say("axisd.v1.LeaseService/RenewLease", "", 200ms);
  EXPECT_THAT(taken(), ElementsAre("echo", "Jog", "late", "late"));
}

TEST_F(LaneTest, ALateRenewalDoesNotBreakTheSilence) {
  run();
  wait(299ms);
  jog(300ms, 200ms);
  EXPECT_THAT(taken(), ElementsAre("late"));
  wait(1ms);
  EXPECT_THAT(taken(), ElementsAre("Halt"));
}

TEST_F(LaneTest, StopsAreNeverTooLate) {
  run();
  stop("Stop", 4s);
  say("axisd.v1.SystemService/StopAll", "", 4s);
  say("axisd.v1.GroupService/GroupHalt", "", 4s);
  say("axisd.v1.GroupService/GroupStop", "", 4s);
  EXPECT_THAT(taken(), ElementsAre("Stop", "StopAll", "GroupHalt", "GroupStop"));
}

TEST_F(LaneTest, WhoStopsManyLetsGoOfAll) {
  for (const auto* method : {"SystemService/StopAll", "GroupService/GroupStop", "GroupService/GroupHalt"}) {
    const auto kind = std::string(method).substr(std::string(method).find('/') + 1);
    jog(300ms, {}, "feeder");
    const auto first = numbers.size() - 1;
    answer(first);
    jog(300ms, {}, "lifter");
    (void)taken();
    say("axisd.v1." + std::string(method), "");
    EXPECT_THAT(taken(), ElementsAre(kind, "Halt", "Halt"));
    EXPECT_EQ(feeder(), Jogging::none);
    EXPECT_EQ(lane.jogging("lifter"), Jogging::ending);
    answer(first + 1);
    EXPECT_THAT(taken(), ElementsAre("answer", "Halt"));
  }
}

TEST_F(LaneTest, ALinkThatIsFarTooLateBeginsAnew) {
  run();
  stop("Stop", 6s);
  EXPECT_THAT(taken(), ElementsAre("Stop", "close"));
  jog();
  EXPECT_THAT(taken(), IsEmpty()) << "nothing is taken behind the end";
}

TEST_F(LaneTest, OtherCallsAreRefused) {
  say("axisd.v1.AxisService/GetAxis", "");
  say("axisd.v1.AxisService/Disable", "");
  say("axisd.v1.LeaseService/AcquireLease", "");
  say("Jog", "");
  EXPECT_THAT(taken(), ElementsAre("refused", "refused", "refused", "refused"));
}

TEST_F(LaneTest, AJogThatIsNoneIsRefused) {
  say("axisd.v1.AxisService/Jog", "\xFF");
  say("axisd.v1.AxisService/Jog", "");
  v1::JogRequest nameless;
  nameless.set_axis("feeder");
  say("axisd.v1.AxisService/Jog", nameless.SerializeAsString());
  v1::JogRequest waits;
  waits.set_axis("feeder");
  waits.mutable_options()->set_request_id("press-1");
  waits.mutable_options()->set_wait_until(v1::WAIT_UNTIL_DONE);
  say("axisd.v1.AxisService/Jog", waits.SerializeAsString());
  EXPECT_THAT(taken(), ElementsAre("refused", "refused", "refused", "refused"));
}

TEST_F(LaneTest, AStopThatNobodyCanReadIsTheDaemonsToRefuse) {
  say("axisd.v1.AxisService/Stop", "\xFF");
  EXPECT_THAT(taken(), ElementsAre("Stop"));
}

TEST_F(LaneTest, WhatIsNoMessageEndsTheLaneAndHaltsWhatIsJogged) {
  run();
  note(lane.receive("nonsense", now));
  EXPECT_THAT(taken(), ElementsAre("Halt", "close"));
}

TEST_F(LaneTest, TenThousandMessagesAtOnceEndTheLane) {
  run();
  for (int i = 0; i < 10'000; ++i) echo();
  const auto said = taken();
  EXPECT_EQ(said.back(), "close");
  EXPECT_THAT(said, testing::Contains("Halt"));
  EXPECT_LE(said.size(), static_cast<std::size_t>(LaneState::pace.at_once) + 2);
}

TEST_F(LaneTest, TheMessageThatIsTooMuchStopsAllTheSame) {
  run();
  for (int i = 0; i < static_cast<int>(LaneState::pace.at_once) - 4; ++i) echo();
  (void)taken();
  stop("QuickStop");
  EXPECT_THAT(taken(), ElementsAre("QuickStop", "close"));
}

TEST_F(LaneTest, SixtyMessagesASecondAreFine) {
  for (int i = 0; i < 6000; ++i) {
    echo();
    wait(16ms);
  }
  EXPECT_THAT(taken(), testing::Each("echo"));
}

TEST_F(LaneTest, MovesThatWaitLeaveStopsTheirPlaces) {
  for (int i = 0; i < LaneState::most_moves + 1; ++i) jog();
  EXPECT_EQ(taken().back(), "refused");
  stop("Stop");
  EXPECT_THAT(taken(), ElementsAre("Stop"));
}

TEST_F(LaneTest, AnswersReachThePageUntilItIsGone) {
  run();
  jog();
  answer(1);
  EXPECT_THAT(taken(), ElementsAre("Jog", "answer"));
  jog();
  close();
  (void)taken();
  answer(2);
  EXPECT_THAT(taken(), ElementsAre("Halt"));
}

}  // namespace
}  // namespace axisd::web
