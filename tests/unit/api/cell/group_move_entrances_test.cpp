// The same move at several entrances, or at one more than once.
#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "tests/unit/api/cell/group_move_bench.hpp"

namespace axisd::cell::group_move {
namespace {

/// The same request through another entrance, which has told it already: nobody is stopped or renewed.
TEST(GroupMoveMachine, WhatAnotherEntranceDoesIsOnlyLookedAt) {
  for (const auto state : {State::preparing, State::telling}) {
    SCOPED_TRACE(static_cast<int>(state));
    Bench bench;
    bench.run_up_to(state);
    if (state == State::preparing) {
      bench.take(Kind::prepare);
      for (std::size_t i = 0; i < 3; ++i) {
        bench.add(bench.move.prepared(
            i, i == 1 ? bench.foreign(i, COMMAND_STATE_ACCEPTED) : bench.answer(i, COMMAND_STATE_ACCEPTED)));
      }
    } else {
      bench.take(Kind::tell);
      bench.add(bench.move.told(1, bench.failure(refusal(axisd::v1::REASON_REQUEST_ID_CONFLICT))));
    }
    EXPECT_EQ(bench.move.state(), State::attached);
    EXPECT_TRUE(bench.move.reached(axisd::v1::WAIT_UNTIL_ACCEPTED));
    EXPECT_FALSE(bench.move.reached(axisd::v1::WAIT_UNTIL_DONE));
    bench.pass(1s);
    EXPECT_EQ(bench.asked(Kind::look), (std::vector<std::size_t>{0, 1, 2}));
    EXPECT_THAT(bench.wire, IsEmpty());
    for (std::size_t i = 0; i < 3; ++i) bench.end(i, COMMAND_STATE_DONE);
    EXPECT_EQ(bench.move.state(), State::over);
    EXPECT_EQ(bench.move.value().state(), COMMAND_STATE_DONE);
  }
}

TEST(GroupMoveMachine, WhatAnotherEntranceDoesAtAMachineThatIsLostIsNotKnown) {
  Bench bench;
  bench.take(Kind::prepare);
  for (std::size_t i = 0; i < 3; ++i)
    bench.add(bench.move.prepared(i, bench.answer(i, COMMAND_STATE_ACTIVE)));
  ASSERT_EQ(bench.move.state(), State::attached);
  bench.end(0, COMMAND_STATE_DONE);
  bench.end(2, COMMAND_STATE_DONE);
  const auto no_route = [&] {
    bench.add(bench.move.looked(1, bench.failure({grpc::StatusCode::UNAVAILABLE, "no route"})));
  };
  no_route();
  bench.pass(GroupMoveMachine::longest_silence - 1ms);
  no_route();
  EXPECT_EQ(bench.move.state(), State::attached);
  bench.add(bench.move.looked(1, bench.answer(1, COMMAND_STATE_ACTIVE)));
  bench.pass(GroupMoveMachine::longest_silence);
  no_route();
  EXPECT_EQ(bench.move.state(), State::attached) << "it has answered since";
  bench.pass(GroupMoveMachine::longest_silence);
  no_route();
  EXPECT_EQ(bench.move.state(), State::over);
  EXPECT_EQ(bench.move.value().state(), COMMAND_STATE_UNKNOWN);
  EXPECT_THAT(bench.asked(Kind::cancel), IsEmpty());
}

TEST(GroupMoveMachine, AMachineThatIsSilentForAWhileTellsWhatAnotherEntranceDid) {
  Bench bench;
  bench.take(Kind::prepare);
  for (std::size_t i = 0; i < 3; ++i)
    bench.add(bench.move.prepared(i, bench.answer(i, COMMAND_STATE_ACTIVE)));
  bench.add(bench.move.looked(1, bench.failure({grpc::StatusCode::DEADLINE_EXCEEDED, "busy"})));
  for (std::size_t i = 0; i < 3; ++i) bench.end(i, COMMAND_STATE_DONE);
  EXPECT_EQ(bench.move.value().state(), COMMAND_STATE_DONE);
}

TEST(GroupMoveMachine, ARequestThatHasEndedIsToldAsItEnded) {
  for (const auto ended : {COMMAND_STATE_DONE, COMMAND_STATE_ABORTED}) {
    Bench bench;
    bench.take(Kind::prepare);
    for (std::size_t i = 0; i < 3; ++i) bench.add(bench.move.prepared(i, bench.answer(i, ended)));
    EXPECT_EQ(bench.move.state(), State::over);
    EXPECT_EQ(bench.move.value().state(), ended);
    EXPECT_TRUE(bench.move.refusal().ok());
    EXPECT_THAT(bench.wire, IsEmpty());
  }
}

/// One entrance was gone after it asked press-1, whose part has ended since: in motion, for all that is
/// known.
TEST(GroupMoveMachine, ARequestThatHasEndedInPartIsToldAsItEnded) {
  Bench bench;
  bench.take(Kind::prepare);
  for (std::size_t i = 0; i < 3; ++i)
    bench.add(
        bench.move.prepared(i, bench.answer(i, i == 0 ? COMMAND_STATE_ABORTED : COMMAND_STATE_ACCEPTED)));
  EXPECT_EQ(bench.move.state(), State::giving_up);
  bench.release_waiting({1, 2});
  EXPECT_EQ(bench.move.state(), State::over);
  EXPECT_TRUE(bench.move.refusal().ok()) << "no refusal: something has moved, perhaps";
  EXPECT_EQ(bench.move.value().state(), COMMAND_STATE_ABORTED);
  EXPECT_THAT(bench.move.value().cause().message(), HasSubstr("press-1: arm: alarm 7"));
}

/// A repeat while the others run, or after they did: that one refuses it says nothing of them.
TEST(GroupMoveMachine, AMachineThatRefusesARepeatDoesNotHideWhatTheOthersDid) {
  for (const bool ended : {false, true}) {
    Bench bench;
    bench.take(Kind::prepare);
    bench.add(bench.move.prepared(0, bench.failure({grpc::StatusCode::UNAVAILABLE, "no route"})));
    for (const std::size_t i : {1U, 2U})
      bench.add(bench.move.prepared(
          i, ended ? bench.answer(i, COMMAND_STATE_DONE) : bench.foreign(i, COMMAND_STATE_ACTIVE)));
    EXPECT_EQ(bench.move.state(), ended ? State::over : State::attached);
    EXPECT_THAT(bench.wire, IsEmpty()) << "nobody is stopped";
    if (!ended)
      for (const std::size_t i : {1U, 2U}) bench.end(i, COMMAND_STATE_DONE);
    EXPECT_EQ(bench.move.state(), State::over);
    EXPECT_TRUE(bench.move.refusal().ok());
    EXPECT_EQ(bench.move.value().state(), COMMAND_STATE_UNKNOWN);
    EXPECT_THAT(bench.move.value().cause().message(), HasSubstr("press-1: no route"));
  }
}

/// Two entrances have prepared the same request, and the other one is faster.
TEST(GroupMoveMachine, WhatAnotherEntranceTellsMeanwhileIsNotStopped) {
  for (const auto state : {COMMAND_STATE_ACCEPTED, COMMAND_STATE_ACTIVE}) {
    Bench bench;
    bench.run_up_to(State::measuring);
    bench.take(Kind::measure);
    bench.add(bench.move.measured(0, bench.foreign(0, state)));
    EXPECT_EQ(bench.move.state(), State::attached);
    bench.add(bench.move.measured(1, bench.failure({grpc::StatusCode::UNAVAILABLE, "a slow link"})));
    EXPECT_EQ(bench.move.state(), State::attached);
    EXPECT_THAT(bench.wire, IsEmpty());
    for (std::size_t i = 0; i < 3; ++i) {
      auto done = bench.foreign(i, COMMAND_STATE_DONE);
      bench.add(bench.move.looked(i, done));
    }
    EXPECT_EQ(bench.move.value().state(), COMMAND_STATE_DONE);
    EXPECT_TRUE(bench.move.refusal().ok());
  }
}

/// This entrance gives up before it has seen that the other one has told them.
TEST(GroupMoveMachine, WhoeverWaitsIsStoppedOnlyIfNobodyElseHasToldIt) {
  for (const bool seen : {true, false})
    for (const auto state : {State::measuring, State::telling}) {
      SCOPED_TRACE(static_cast<int>(state));
      Bench bench;
      bench.run_up_to(state);
      const auto slow = bench.failure({grpc::StatusCode::DEADLINE_EXCEEDED, "a slow link"});
      bench.add(state == State::measuring ? bench.move.measured(1, slow) : bench.move.told(1, slow));
      ASSERT_EQ(bench.move.state(), State::giving_up);
      EXPECT_THAT(bench.asked(Kind::cancel), IsEmpty());
      bench.take(Kind::look);
      bench.take(Kind::measure);
      bench.take(Kind::tell);
      if (seen) {
        bench.add(bench.move.looked(0, bench.foreign(0, COMMAND_STATE_ACTIVE)));
      } else {
        bench.end(0, COMMAND_STATE_ACCEPTED);
        EXPECT_EQ(bench.move.state(), State::giving_up);
        bench.add(bench.move.told(0, bench.failure(refusal(axisd::v1::REASON_REQUEST_ID_CONFLICT))));
      }
      EXPECT_EQ(bench.move.state(), State::attached);
      EXPECT_THAT(bench.wire, IsEmpty());
      for (std::size_t i = 0; i < 3; ++i)
        bench.add(bench.move.looked(i, bench.foreign(i, COMMAND_STATE_DONE)));
      EXPECT_EQ(bench.move.state(), State::over);
      EXPECT_TRUE(bench.move.refusal().ok());
      EXPECT_EQ(bench.move.value().state(), COMMAND_STATE_DONE);
      EXPECT_THAT(bench.asked(Kind::cancel), IsEmpty());
    }
}

/// Its answer to the telling was lost: by its moment it is this entrance's, and is stopped.
TEST(GroupMoveMachine, WhatHasThisEntrancesMomentIsStopped) {
  Bench bench;
  bench.run_up_to(State::telling);
  const auto at = bench.take(Kind::tell)[0].at;
  bench.add(bench.move.told(1, bench.failure({grpc::StatusCode::DEADLINE_EXCEEDED, "a slow link"})));
  EXPECT_EQ(bench.asked(Kind::look), (std::vector<std::size_t>{0, 1, 2}));
  auto answer = bench.answer(0, COMMAND_STATE_ACCEPTED);
  set_duration(*answer.move.mutable_preparation()->mutable_starts_at(), at);
  bench.add(bench.move.looked(0, answer));
  EXPECT_EQ(bench.move.state(), State::giving_up);
  EXPECT_EQ(bench.asked(Kind::cancel), (std::vector<std::size_t>{0}));
}

}  // namespace
}  // namespace axisd::cell::group_move
