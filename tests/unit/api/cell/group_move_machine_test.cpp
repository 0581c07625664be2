// Moves of axes of several machines by one entrance.
#include <gmock/gmock.h>

#include <limits>
#include <string>
#include <vector>

#include "tests/unit/api/cell/group_move_bench.hpp"

namespace axisd::cell::group_move {
namespace {

TEST(GroupMoveMachine, EachIsPreparedMeasuredToldAndRenewed) {
  Bench bench;
  EXPECT_THAT(bench.wire, ::testing::SizeIs(3));
  EXPECT_EQ(bench.move.state(), State::preparing);
  bench.prepare();
  EXPECT_EQ(bench.move.state(), State::measuring);
  bench.measure();
  EXPECT_EQ(bench.move.state(), State::telling);
  const auto tellings = bench.take(Kind::tell);
  ASSERT_EQ(tellings.size(), 3U);
  const auto moment = tellings[0].at - bench.offset(0);
  for (const auto& errand : tellings) {
    // One moment, by each machine's own clock; whoever needs most notice has it.
    EXPECT_LE(std::chrono::abs(errand.at - bench.offset(errand.machine) - moment), 1us);
    EXPECT_GE(errand.at, bench.now.time_since_epoch() + bench.offset(errand.machine) + 150ms);
  }
  for (const auto& errand : tellings) {
    EXPECT_THAT(bench.take(Kind::renew), IsEmpty()) << "nobody is told that all were before they were";
    bench.add(bench.move.told(errand.machine, bench.answer(errand.machine, COMMAND_STATE_ACCEPTED)));
  }
  EXPECT_EQ(bench.move.state(), State::running);
  for (const auto& errand : bench.wire) {
    EXPECT_EQ(errand.kind, Kind::renew);
    EXPECT_TRUE(errand.all_told);
  }
  EXPECT_EQ(bench.asked(Kind::renew), (std::vector<std::size_t>{0, 1, 2}));
  bench.pass(GroupMoveMachine::renewal_period + 10ms);
  EXPECT_EQ(bench.asked(Kind::renew), (std::vector<std::size_t>{0, 1, 2}));
}

TEST(GroupMoveMachine, SixteenMachinesAreAskedAsOftenEachAsThree) {
  const auto errands_of = [](std::size_t machines) {
    Bench bench(machines);
    std::size_t errands = bench.wire.size();
    bench.prepare();
    for (auto asked = bench.take(Kind::measure); !asked.empty(); asked = bench.take(Kind::measure)) {
      errands += asked.size();
      for (const auto& errand : asked)
        bench.add(bench.move.measured(errand.machine, bench.answer(errand.machine, COMMAND_STATE_ACCEPTED)));
    }
    errands += bench.wire.size();
    bench.tell();
    EXPECT_EQ(bench.move.state(), State::running) << machines;
    errands += bench.take(Kind::renew).size();
    bench.pass(GroupMoveMachine::renewal_period + 10ms);
    return errands + bench.take(Kind::renew).size();
  };
  EXPECT_EQ(errands_of(16) * 3, errands_of(3) * 16);
}

/// While it runs they do not tell their members, which are stopped by their commands all the same.
TEST(GroupMoveMachine, MembersAreKnownFromThePreparation) {
  Bench bench;
  bench.run_up_to(State::running);
  for (std::size_t i = 0; i < 3; ++i) {
    auto answer = bench.answer(i, COMMAND_STATE_ACTIVE);
    answer.move.clear_members();
    bench.add(bench.move.renewed(i, answer));
    EXPECT_THAT(bench.move.commands_at(i), ::testing::ElementsAre("c-" + std::to_string(i)));
  }
  for (const auto& part : bench.move.value().machines()) {
    ASSERT_EQ(part.move().members_size(), 1);
    EXPECT_EQ(part.move().members(0).command().state(), COMMAND_STATE_ACTIVE);
  }
}

TEST(GroupMoveMachine, ItIsDoneWhenAllAre) {
  Bench bench;
  bench.run_up_to(State::running);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(bench.move.state(), State::running);
    bench.add(bench.move.renewed(i, bench.answer(i, COMMAND_STATE_DONE)));
  }
  EXPECT_EQ(bench.move.state(), State::over);
  EXPECT_EQ(bench.move.value().state(), COMMAND_STATE_DONE);
  EXPECT_TRUE(bench.move.refusal().ok());
  bench.pass(1s);
  EXPECT_THAT(bench.wire, IsEmpty()) << "nobody is asked any more";
}

/// The answer tells machine and axis, and comes when the others have let go.
TEST(GroupMoveMachine, WhatForbidsOneForbidsAll) {
  Bench bench;
  bench.add(bench.move.prepared(0, bench.answer(0, COMMAND_STATE_ACCEPTED)));
  bench.add(bench.move.prepared(1, bench.failure(refusal())));
  EXPECT_EQ(bench.move.state(), State::preparing) << "the last one may be told already, by another entrance";
  bench.add(bench.move.prepared(2, bench.answer(2, COMMAND_STATE_ACCEPTED)));
  EXPECT_EQ(bench.move.state(), State::giving_up);
  EXPECT_FALSE(bench.move.reached(axisd::v1::WAIT_UNTIL_ACCEPTED));
  bench.release_waiting({0, 2});
  EXPECT_EQ(bench.move.state(), State::over);
  EXPECT_EQ(bench.move.refusal().error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(bench.move.refusal().error_message(), HasSubstr("press-2: feeder: no"));
  EXPECT_EQ(detail_of(bench.move.refusal()).reason(), axisd::v1::REASON_SOFT_LIMIT);
  EXPECT_EQ(bench.move.value().state(), COMMAND_STATE_ABORTED);
}

TEST(GroupMoveMachine, WhereverItIsWhoIsLostOrFailsStopsTheOthers) {
  for (const bool lost : {true, false})
    for (const auto state : {State::measuring, State::telling, State::running}) {
      SCOPED_TRACE(static_cast<int>(state));
      Bench bench;
      bench.run_up_to(state);
      ASSERT_EQ(bench.move.state(), state);
      bench.take(Kind::tell);
      const auto answer = lost ? bench.failure({grpc::StatusCode::UNAVAILABLE, "no route"})
                               : bench.answer(1, COMMAND_STATE_ABORTED);
      bench.add(state == State::measuring ? bench.move.measured(1, answer)
                : state == State::telling ? bench.move.told(1, answer)
                                          : bench.move.renewed(1, answer));
      EXPECT_EQ(bench.move.state(), State::giving_up);
      EXPECT_THAT(bench.move.value().cause().message(),
                  HasSubstr(lost ? "press-2: no route" : "press-2: arm: alarm 7"));
      const auto left = lost ? (std::vector<std::size_t>{0, 1, 2}) : (std::vector<std::size_t>{0, 2});
      if (state == State::running)
        EXPECT_EQ(bench.asked(Kind::cancel), left);
      else
        bench.stop_waiting(left);
      EXPECT_EQ(bench.move.refusal().ok(), state != State::measuring);
      bench.take(Kind::renew);
      bench.pass(GroupMoveMachine::renewal_period);
      EXPECT_THAT(bench.take(Kind::renew), IsEmpty()) << "whoever does not hear of it stops by itself";
      for (std::size_t i = 0; i < 3; ++i) bench.end(i, COMMAND_STATE_ABORTED);
      EXPECT_EQ(bench.move.state(), State::over);
      EXPECT_EQ(bench.move.value().state(), COMMAND_STATE_ABORTED);
    }
}

TEST(GroupMoveMachine, AStopThatDidNotArriveIsSentAgain) {
  Bench bench;
  bench.run_up_to(State::running);
  bench.add(bench.move.renewed(1, bench.answer(1, COMMAND_STATE_ABORTED)));
  EXPECT_EQ(bench.asked(Kind::cancel), (std::vector<std::size_t>{0, 2}));
  bench.add(bench.move.cancelled(0, grpc::Status::OK));
  bench.add(bench.move.cancelled(2, {grpc::StatusCode::UNAVAILABLE, "no route"}));
  bench.pass(GroupMoveMachine::look_period);
  EXPECT_EQ(bench.asked(Kind::cancel), (std::vector<std::size_t>{2}));
}

TEST(GroupMoveMachine, OfAMachineThatDoesNotSayItIsNotKnown) {
  Bench bench;
  bench.run_up_to(State::running);
  for (std::size_t i = 0; i < 3; ++i) bench.add(bench.move.renewed(i, bench.answer(i, COMMAND_STATE_ACTIVE)));
  bench.add(bench.move.renewed(1, bench.failure({grpc::StatusCode::UNAVAILABLE, "no route"})));
  bench.end(0, COMMAND_STATE_ABORTED);
  bench.end(2, COMMAND_STATE_ABORTED);
  EXPECT_EQ(bench.move.state(), State::giving_up);
  bench.add(bench.move.looked(1, bench.failure({grpc::StatusCode::UNAVAILABLE, "no route"})));
  EXPECT_EQ(bench.move.state(), State::giving_up);
  bench.pass(GroupMoveMachine::longest_end);
  EXPECT_EQ(bench.move.state(), State::over);
  EXPECT_EQ(bench.move.value().state(), COMMAND_STATE_UNKNOWN);
  EXPECT_THAT(bench.move.value().machines(1).error().message(), HasSubstr("no route"));
}

/// Its axisd was started anew, and knows nothing of the move: it starts nothing of it.
TEST(GroupMoveMachine, WhoDoesNotKnowTheMoveAnyMoreHasEnded) {
  Bench bench;
  bench.run_up_to(State::running);
  bench.add(bench.move.renewed(1, bench.failure(refusal(axisd::v1::REASON_UNKNOWN_COMMAND))));
  EXPECT_EQ(bench.move.state(), State::giving_up);
  bench.end(0, COMMAND_STATE_ABORTED);
  bench.end(2, COMMAND_STATE_ABORTED);
  bench.add(bench.move.looked(1, bench.failure(refusal(axisd::v1::REASON_UNKNOWN_COMMAND))));
  EXPECT_EQ(bench.move.state(), State::over);
}

TEST(GroupMoveMachine, AClockThatIsNotKnownWellEnoughIsRefused) {
  Bench bench(2, {.clock_tolerance = 50us});
  bench.trip = 300us;
  bench.run_up_to(State::telling);
  EXPECT_EQ(bench.move.state(), State::giving_up);
  EXPECT_THAT(bench.move.value().cause().message(),
              HasSubstr("press-1: its clock is known to 0.150 ms only"));
  bench.release_waiting({0, 1});
  EXPECT_EQ(bench.move.refusal().error_code(), grpc::StatusCode::OUT_OF_RANGE);
}

TEST(GroupMoveMachine, WhoIsPreparedTooLateForTheOthersStartsNobody) {
  Bench bench;
  bench.expires = 100s + 300ms;
  bench.run_up_to(State::telling);
  EXPECT_EQ(bench.move.state(), State::giving_up);
  EXPECT_EQ(bench.move.value().cause().reason(), axisd::v1::REASON_EXPIRED);
  bench.release_waiting({0, 1, 2});
  EXPECT_EQ(bench.move.state(), State::over);
}

TEST(GroupMoveMachine, NobodyStartsWhenTheCallerNoLongerWaits) {
  Bench bench(3, {.clock_tolerance = 1ms, .start_by = TimePoint(100s + 300ms)});
  bench.run_up_to(State::telling);
  EXPECT_EQ(bench.move.state(), State::giving_up);
  EXPECT_EQ(bench.move.value().cause().reason(), axisd::v1::REASON_EXPIRED);
  bench.release_waiting({0, 1, 2});
  EXPECT_EQ(bench.move.state(), State::over);
  EXPECT_EQ(bench.move.refusal().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);

  Bench patient(3, {.clock_tolerance = 1ms, .start_by = TimePoint(100s + 600ms)});
  patient.run_up_to(State::telling);
  EXPECT_EQ(patient.move.state(), State::telling);
  for (const auto& tell : patient.take(Kind::tell))
    EXPECT_LE(tell.at - patient.offset(tell.machine), 100s + 600ms);
}

/// Its preparation is nearly over: it takes no moment any more, and ends by itself.
TEST(GroupMoveMachine, WhoTakesNoMomentAnyMoreIsAwaited) {
  Bench bench;
  bench.run_up_to(State::measuring);
  bench.take(Kind::measure);
  bench.add(bench.move.measured(1, bench.answer(1, COMMAND_STATE_ABORTED)));
  for (const auto& tell : bench.take(Kind::tell)) {
    EXPECT_EQ(tell.at, bench.expires + bench.offset(tell.machine)) << "any moment of it will do";
    bench.add(bench.move.told(tell.machine, bench.failure(refusal(axisd::v1::REASON_EXPIRED))));
  }
  EXPECT_EQ(bench.move.state(), State::giving_up);
  EXPECT_THAT(bench.asked(Kind::cancel), IsEmpty());
  bench.take(Kind::look);
  bench.pass(GroupMoveMachine::look_period);
  EXPECT_EQ(bench.asked(Kind::look), (std::vector<std::size_t>{0, 2}));
  for (const std::size_t i : {0U, 2U}) bench.end(i, COMMAND_STATE_ABORTED);
  EXPECT_EQ(bench.move.state(), State::over);
}

TEST(GroupMoveMachine, WhereNotAllAreToldInTimeNobodyStarts) {
  Bench bench;
  bench.run_up_to(State::telling);
  const auto tellings = bench.take(Kind::tell);
  bench.add(bench.move.told(0, bench.taken(tellings[0])));
  bench.pass(GroupMoveMachine::lead / 2 - 50ms);
  EXPECT_EQ(bench.move.state(), State::telling);
  for (const auto& errand : bench.take(Kind::renew)) EXPECT_FALSE(errand.all_told);
  bench.pass(60ms);
  EXPECT_EQ(bench.move.state(), State::giving_up);
  EXPECT_EQ(bench.asked(Kind::cancel), (std::vector<std::size_t>{0}));
  EXPECT_THAT(bench.take(Kind::renew), IsEmpty());
  for (const auto& tell : bench.take(Kind::tell))
    EXPECT_EQ(tell.at, tellings[tell.machine].at) << "it may have that one already";
  // What is under way changes nothing.
  bench.add(bench.move.told(1, bench.taken(tellings[1])));
  EXPECT_EQ(bench.move.state(), State::giving_up);
  EXPECT_EQ(bench.asked(Kind::cancel), (std::vector<std::size_t>{1}));
  EXPECT_THAT(bench.take(Kind::renew), IsEmpty());
}

TEST(GroupMoveMachine, ASkewIsToldWithItsBound) {
  Bench bench;
  bench.run_up_to(State::running);
  const auto first = bench.now + 300ms;
  bench.now = first + 100ms;
  for (std::size_t i = 0; i < 3; ++i) {
    auto answer = bench.answer(i, COMMAND_STATE_DONE);
    const auto started = first + i * Duration(2ms);
    set_duration(*answer.move.mutable_preparation()->mutable_first_start(),
                 started.time_since_epoch() + bench.offset(i));
    set_duration(*answer.move.mutable_start_skew(), Duration(5ms));
    bench.add(bench.move.renewed(i, answer));
  }
  const auto move = bench.move.value();
  const auto ns = [](const google::protobuf::Duration& time) {
    return time.seconds() * 1'000'000'000 + time.nanos();
  };
  const auto bound = ns(move.start_skew_error());
  EXPECT_GT(bound, 0);
  EXPECT_LT(bound, 400'000) << "twice half a round trip, and drift";
  EXPECT_LE(std::abs(ns(move.start_skew()) - 9'000'000), bound);
  EXPECT_LE(std::abs(ns(move.machines(2).started_after()) - 4'000'000), bound);
  EXPECT_LE(std::abs(ns(move.machines(1).clock_offset()) - 7'200'000'000'000),
            ns(move.machines(1).clock_error()));
}

/// Clocks drift apart: the samples near the start are the ones that count, however long the move then lasts.
TEST(GroupMoveMachine, ALongMoveKeepsTheSkewOfItsStart) {
  Bench bench(2);
  bench.run_up_to(State::running);
  const auto first = bench.now + 300ms;
  bench.now = first + 100ms;
  const auto renew = [&](axisd::v1::CommandState state) {
    for (std::size_t i = 0; i < bench.count; ++i) {
      auto answer = bench.answer(i, state);
      set_duration(*answer.move.mutable_preparation()->mutable_first_start(),
                   first.time_since_epoch() + bench.offset(i));
      set_duration(*answer.move.mutable_start_skew(), Duration{});
      bench.add(bench.move.renewed(i, answer));
    }
  };
  for (int i = 0; i < 400; ++i) {
    renew(COMMAND_STATE_ACTIVE);
    bench.now += GroupMoveMachine::renewal_period;
  }
  renew(COMMAND_STATE_DONE);
  EXPECT_EQ(bench.move.state(), State::over);
  EXPECT_LT(duration_of(bench.move.value().start_skew_error()), 500us);
}

/// Whatever a machine answers.
TEST(GroupMoveMachine, TimesThatNoClockShowsEndTheMove) {
  for (const auto seconds :
       {std::numeric_limits<std::int64_t>::max(), std::numeric_limits<std::int64_t>::min()}) {
    google::protobuf::Duration from;
    from.set_seconds(seconds);
    from.set_nanos(seconds < 0 ? std::numeric_limits<std::int32_t>::min()
                               : std::numeric_limits<std::int32_t>::max());
    EXPECT_LT(std::chrono::abs(duration_of(from)), std::chrono::years(31));
  }
  Bench bench;
  bench.take(Kind::prepare);
  for (std::size_t i = 0; i < 3; ++i) {
    auto answer = bench.answer(i, COMMAND_STATE_ACCEPTED);
    answer.move.mutable_preparation()->mutable_notice()->set_seconds(
        std::numeric_limits<std::int64_t>::max());
    bench.add(bench.move.prepared(i, answer));
  }
  for (auto errands = bench.take(Kind::measure); !errands.empty(); errands = bench.take(Kind::measure))
    for (const auto& errand : errands) {
      auto answer = bench.answer(errand.machine, COMMAND_STATE_ACCEPTED);
      answer.move.mutable_preparation()->mutable_notice()->set_seconds(
          std::numeric_limits<std::int64_t>::max());
      bench.add(bench.move.measured(errand.machine, answer));
    }
  EXPECT_EQ(bench.move.state(), State::giving_up);
  EXPECT_EQ(bench.move.value().cause().reason(), axisd::v1::REASON_EXPIRED);
}

TEST(GroupMoveMachine, WhoWaitsForTheStartWaitsForAll) {
  Bench bench;
  bench.run_up_to(State::running);
  EXPECT_TRUE(bench.move.reached(axisd::v1::WAIT_UNTIL_UNSPECIFIED));
  EXPECT_EQ(bench.move.value().state(), COMMAND_STATE_ACCEPTED);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_FALSE(bench.move.reached(axisd::v1::WAIT_UNTIL_STARTED));
    bench.add(bench.move.renewed(i, bench.answer(i, COMMAND_STATE_ACTIVE)));
  }
  EXPECT_TRUE(bench.move.reached(axisd::v1::WAIT_UNTIL_STARTED));
  EXPECT_EQ(bench.move.value().state(), COMMAND_STATE_ACTIVE);
}

}  // namespace
}  // namespace axisd::cell::group_move
