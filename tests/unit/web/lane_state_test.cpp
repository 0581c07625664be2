#include "api/web/gateway/lane_state.hpp"

#include <gmock/gmock.h>

#include <string>
#include <utility>
#include <vector>

#include "api/web/gateway/big_endian.hpp"
#include "axisd/v1/axis_service.pb.h"
#include "axisd/v1/lease_service.pb.h"
#include "axisd/v1/system_service.pb.h"

namespace axisd::web {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;

/// A page with a link that takes no time, unless it says so, and what came of what it did.
class LaneTest : public testing::Test {
 protected:
  void note(const LaneEffects& effects) {
    for (const auto& effect : effects) {
      if (const auto* call = std::get_if<LaneCall>(&effect)) {
        log.push_back(std::string(name_of(call->method)));
        numbers.push_back(call->number);
        messages.push_back(call->message);
        patience.push_back(call->patience);
      } else if (const auto* bytes = std::get_if<LaneSend>(&effect)) {
        constexpr const char* kinds[] = {"?", "answer", "late", "echo", "refused"};
        log.emplace_back(kinds[static_cast<std::size_t>(bytes->bytes.front())]);
        if (log.back() == "echo") number = bytes->bytes.substr(bytes->bytes.size() - 8);
      } else {
        log.emplace_back("close");
      }
    }
  }
  void say(std::string_view method, const std::string& message, Duration late = {}) {
    std::string bytes(1, '\1');
    append_big_endian32(bytes, ++last_id);
    append_big_endian32(bytes, static_cast<std::uint32_t>((now - late).time_since_epoch() / 1ms));
    bytes += static_cast<char>(method.size());
    bytes += method;
    bytes += message;
    note(lane.receive(bytes, now));
  }
  void echo(Duration late = {}) { say("", "", late); }
  void return_number() { say("", number); }
  void SetUp() override {
    echo();
    return_number();
    (void)taken();
  }
  void jog(Duration hold = 300ms, Duration late = {}, const std::string& axis = "feeder") {
    v1::JogRequest request;
    request.set_axis(axis);
    request.set_velocity(1);
    request.mutable_options()->set_request_id(press);
    request.mutable_hold()->set_nanos(static_cast<std::int32_t>(hold.count()));
    say("axisd.v1.AxisService/Jog", request.SerializeAsString(), late);
  }
  void stop(std::string_view kind = "Halt", Duration late = {}) {
    v1::HaltRequest request;  // Stop and QuickStop have the axis at the same place
    request.set_axis("feeder");
    say("axisd.v1.AxisService/" + std::string(kind), request.SerializeAsString(), late);
  }
  /// Of the n-th call.
  void answer(std::size_t call, v1::CommandState state = v1::COMMAND_STATE_ACTIVE) {
    v1::JogResponse response;
    response.mutable_command()->set_state(state);
    note(lane.answered(numbers.at(call), {}, response.SerializeAsString(), now));
  }
  void fail(std::size_t call, int code, const std::string& details = {}) {
    note(lane.answered(numbers.at(call), {.code = code, .message = {}, .details = details}, {}, now));
  }
  void wait(Duration duration) {
    const auto end = now + duration;
    while (lane.next_due() <= end) {
      now = std::max(now, lane.next_due());
      note(lane.pass(now));
    }
    now = end;
  }
  void close() { note(lane.close(now)); }
  [[nodiscard]] Jogging feeder() const { return lane.jogging("feeder"); }
  [[nodiscard]] std::vector<std::string> taken() { return std::exchange(log, {}); }
  /// A jog that runs.
  void run() {
    echo();
    jog();
    answer(0);
    (void)taken();
    ASSERT_EQ(feeder(), Jogging::running);
  }

  TimePoint now{Duration(1h)};
  std::uint64_t random = 0x0123456789ABCDEF;
  LaneState lane{[this] { return ++random; }};
  std::string press = "press-1", number;
  std::vector<std::string> log, messages;
  std::vector<std::uint64_t> numbers;
  std::vector<Duration> patience;
  std::uint32_t last_id = 0;
};

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

// What was refused stays refused.

TEST_F(LaneTest, APressThatWasRefusedNeverStarts) {
  for (const int why : {code::resource_exhausted, code::unavailable, code::failed_precondition}) {
    press = "press-" + std::to_string(why);
    jog();
    fail(numbers.size() - 1, why);
    (void)taken();
    jog();
    EXPECT_THAT(taken(), ElementsAre("refused"));
    wait(1s);
    jog();
    EXPECT_EQ(taken().back(), "refused");
  }
  press = "another";
  jog();
  EXPECT_THAT(taken(), ElementsAre("Jog"));
}

TEST_F(LaneTest, APressThatCameTooLateNeverStarts) {
  jog(300ms, 200ms);
  EXPECT_THAT(taken(), ElementsAre("late"));
  jog();
  EXPECT_THAT(taken(), ElementsAre("refused"));
  jog(300ms, {}, "lifter");
  EXPECT_THAT(taken(), ElementsAre("Jog")) << "another axis";
  stop();
  (void)taken();
  jog();
  EXPECT_THAT(taken(), ElementsAre("Jog")) << "behind a stop";
}

TEST_F(LaneTest, ALateRenewalOfWhatIsOnItsWayIsOnlyDropped) {
  jog();
  jog(300ms, 200ms);
  answer(0);
  (void)taken();
  jog();
  EXPECT_THAT(taken(), ElementsAre("Jog"));
}

TEST_F(LaneTest, APressThatStartsAfterItWasRefusedIsHalted) {
  jog();
  jog();
  (void)taken();
  fail(0, code::resource_exhausted);
  answer(1);
  EXPECT_THAT(taken(), ElementsAre("answer", "answer", "Halt"));
  EXPECT_EQ(feeder(), Jogging::none);
}

TEST_F(LaneTest, ARefusalOfAnotherPressLeavesWhatRuns) {
  run();
  press = "press-2";
  jog();
  fail(1, code::resource_exhausted);
  EXPECT_EQ(feeder(), Jogging::running);
  (void)taken();
  jog();
  EXPECT_THAT(taken(), ElementsAre("refused"));
  wait(300ms);
  EXPECT_THAT(taken(), ElementsAre("Halt"));
}

TEST_F(LaneTest, RefusedPressesOfABoundedNumberOfAxesAreRemembered) {
  for (std::size_t i = 0; i < LaneState::most_barred + 10; ++i) {
    jog(300ms, 200ms, "axis-" + std::to_string(i));
    wait(20ms);
  }
  jog(300ms, {}, "axis-" + std::to_string(LaneState::most_barred + 9));
  EXPECT_EQ(taken().back(), "refused") << "the last ones";
}

// How late the first message is.

TEST(LaneMeasure, NothingStartsBeforeTheNumberOfAnEchoCameBack) {
  TimePoint now{Duration(1h)};
  std::uint64_t last = 7;
  LaneState lane([&] { return ++last; });
  std::uint32_t id = 0;
  std::string reply;
  const auto say = [&](std::string_view method, const std::string& message) {
    std::string bytes(1, '\1');
    append_big_endian32(bytes, ++id);
    append_big_endian32(bytes, static_cast<std::uint32_t>(now.time_since_epoch() / 1ms));
    bytes += static_cast<char>(method.size());
    bytes += method;
    bytes += message;
    const auto effects = lane.receive(bytes, now);
    const auto* sent = effects.empty() ? nullptr : std::get_if<LaneSend>(&effects.front());
    reply = sent == nullptr ? "passed on" : sent->bytes;
  };
  v1::JogRequest jog;
  jog.set_axis("feeder");
  const auto press = [&] {
    jog.mutable_options()->set_request_id(std::to_string(id));
    say("axisd.v1.AxisService/Jog", jog.SerializeAsString());
    return reply == "passed on";
  };
  const auto number = [&] { return reply.substr(reply.size() - 8); };
  EXPECT_FALSE(press());
  EXPECT_EQ(reply.front(), '\4');
  say("axisd.v1.AxisService/Stop", "");
  EXPECT_EQ(reply, "passed on") << "stops wait for nothing";
  say("", "");
  EXPECT_FALSE(press()) << "the echo may have been on its way for long, and so may this";
  say("", "");
  const auto old = number();
  say("", "");
  say("", old);
  EXPECT_FALSE(press()) << "not the last one";
  auto late = number();
  now += LaneState::longest_round_trip + 1ms;
  say("", late);
  EXPECT_FALSE(press()) << "too slow to know it well";
  late = number();
  now += LaneState::longest_round_trip;
  say("", late);
  EXPECT_TRUE(press());
  say("axisd.v1.LeaseService/RenewLease", "");
  EXPECT_EQ(reply, "passed on");
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
  EXPECT_THAT(patience, ElementsAre(LaneState::patience_of_moves, LaneState::patience_of_stops,
                                    LaneState::patience_of_moves, LaneState::longest_hold,
                                    LaneState::longest_hold - LaneState::pause))
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
  say("axisd.v1.AxisService/MoveAbsolute", "");
  say("axisd.v1.AxisService/Enable", "");
  say("axisd.v1.AxisService/ReleaseStop", "");
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
