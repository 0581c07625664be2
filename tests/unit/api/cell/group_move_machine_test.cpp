#include "api/cell/group_move_machine.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "api/cell/roster.hpp"
#include "api/cell/status.hpp"

namespace axisd::cell {
namespace {

using namespace std::chrono_literals;
using axisd::v1::COMMAND_STATE_ABORTED;
using axisd::v1::COMMAND_STATE_ACCEPTED;
using axisd::v1::COMMAND_STATE_ACTIVE;
using axisd::v1::COMMAND_STATE_DONE;
using axisd::v1::COMMAND_STATE_UNKNOWN;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Errand = GroupMoveMachine::Errand;
using Kind = Errand::Kind;
using State = GroupMoveMachine::State;

grpc::Status refusal(axisd::v1::Reason reason = axisd::v1::REASON_SOFT_LIMIT) {
  return to_status(grpc::StatusCode::FAILED_PRECONDITION, reason, "feeder: no", "ask for less");
}

/// Machines press-1, press-2 ..., whose clocks are an hour, two hours ... ahead.
class Bench {
 public:
  explicit Bench(std::size_t machines = 3, Duration tolerance = 1ms)
      : count(machines), move(names(machines), tolerance) {
    wire = move.begin();
  }

  static std::vector<std::string> names(std::size_t count) {
    std::vector<std::string> all;
    for (std::size_t i = 0; i < count; ++i) all.push_back("press-" + std::to_string(i + 1));
    return all;
  }
  [[nodiscard]] Duration offset(std::size_t machine) const { return (machine + 1) * Duration(1h); }
  [[nodiscard]] axisd::v1::GroupMove part(std::size_t machine, axisd::v1::CommandState state) const {
    axisd::v1::GroupMove made;
    made.set_id("g-" + std::to_string(machine));
    made.set_state(state);
    auto& command = *made.add_members()->mutable_command();
    command.set_id("c-" + std::to_string(machine));
    command.set_state(state);
    auto& preparation = *made.mutable_preparation();
    set_duration(*preparation.mutable_expires(), expires + offset(machine));
    set_duration(*preparation.mutable_notice(), (machine + 1) * Duration(50ms));
    if (state == COMMAND_STATE_ABORTED) made.mutable_cause()->set_message("arm: alarm 7");
    return made;
  }
  /// Its answer after a round trip, half of which each way.
  [[nodiscard]] GroupMoveMachine::Answer answer(std::size_t machine, axisd::v1::CommandState state) {
    const auto sent = now;
    now += trip;
    return {.sent = sent,
            .received = now,
            .move = part(machine, state),
            .clock = (sent + trip / 2).time_since_epoch() + offset(machine)};
  }
  /// Of a part that another entrance has told.
  [[nodiscard]] GroupMoveMachine::Answer foreign(std::size_t machine, axisd::v1::CommandState state) {
    auto made = answer(machine, state);
    made.move.mutable_preparation()->mutable_starts_at()->set_seconds(7);
    return made;
  }
  [[nodiscard]] GroupMoveMachine::Answer failure(grpc::Status status) const {
    return {.sent = now, .received = now, .status = std::move(status)};
  }
  void add(GroupMoveMachine::Errands more) { wire.insert(wire.end(), more.begin(), more.end()); }
  /// The errands of one kind, which leave the wire.
  GroupMoveMachine::Errands take(Kind kind) {
    GroupMoveMachine::Errands taken;
    std::erase_if(wire, [&](const Errand& errand) {
      if (errand.kind != kind) return false;
      taken.push_back(errand);
      return true;
    });
    return taken;
  }
  [[nodiscard]] std::vector<std::size_t> asked(Kind kind) {
    std::vector<std::size_t> machines;
    for (const auto& errand : take(kind)) machines.push_back(errand.machine);
    return machines;
  }

  void prepare() {
    for (const auto& errand : take(Kind::prepare))
      add(move.prepared(errand.machine, answer(errand.machine, COMMAND_STATE_ACCEPTED)));
  }
  void measure() {
    for (auto errands = take(Kind::measure); !errands.empty(); errands = take(Kind::measure))
      for (const auto& errand : errands)
        add(move.measured(errand.machine, answer(errand.machine, COMMAND_STATE_ACCEPTED)));
  }
  void tell() {
    for (const auto& errand : take(Kind::tell))
      add(move.told(errand.machine, answer(errand.machine, COMMAND_STATE_ACCEPTED)));
  }
  void run_up_to(State state) {
    if (state == State::preparing) return;
    prepare();
    if (state == State::measuring) return;
    measure();
    if (state == State::telling) return;
    tell();
    EXPECT_EQ(move.state(), State::running);
    take(Kind::renew);
  }
  void pass(Duration time) {
    now += time;
    add(move.tick(now));
  }
  void end(std::size_t machine, axisd::v1::CommandState state) {
    add(move.looked(machine, answer(machine, state)));
  }

  /// Those that wait for their moment say so when they are looked at, and are stopped then.
  void release_waiting(const std::vector<std::size_t>& machines) {
    EXPECT_THAT(asked(Kind::cancel), IsEmpty()) << "another entrance may have told them since";
    EXPECT_EQ(asked(Kind::look), machines);
    for (const auto machine : machines) end(machine, COMMAND_STATE_ACCEPTED);
    EXPECT_EQ(asked(Kind::cancel), machines);
    for (const auto machine : machines) end(machine, COMMAND_STATE_ABORTED);
  }

  const std::size_t count;
  TimePoint now{100s};
  Duration expires = 102s, trip = 200us;
  GroupMoveMachine move;
  GroupMoveMachine::Errands wire;
};

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
      const auto answer = lost ? bench.failure({grpc::StatusCode::UNAVAILABLE, "no route"})
                               : bench.answer(1, COMMAND_STATE_ABORTED);
      bench.add(state == State::measuring ? bench.move.measured(1, answer)
                : state == State::telling ? bench.move.told(1, answer)
                                          : bench.move.renewed(1, answer));
      EXPECT_EQ(bench.move.state(), State::giving_up);
      EXPECT_THAT(bench.move.value().cause().message(),
                  HasSubstr(lost ? "press-2: no route" : "press-2: arm: alarm 7"));
      const auto left = lost ? (std::vector<std::size_t>{0, 1, 2}) : (std::vector<std::size_t>{0, 2});
      if (state != State::running) {
        EXPECT_THAT(bench.asked(Kind::cancel), IsEmpty()) << "whoever waits starts nothing";
        EXPECT_EQ(bench.asked(Kind::look), left);
        for (const auto machine : left) bench.end(machine, COMMAND_STATE_ACCEPTED);
      }
      EXPECT_EQ(bench.asked(Kind::cancel), left);
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
  Bench bench(2, 50us);
  bench.trip = 300us;
  bench.run_up_to(State::telling);
  EXPECT_EQ(bench.move.state(), State::giving_up);
  EXPECT_THAT(bench.move.value().cause().message(),
              HasSubstr("press-1: its clock is known to 0.150 ms only"));
  bench.release_waiting({0, 1});
  EXPECT_EQ(bench.move.refusal().error_code(), grpc::StatusCode::OUT_OF_RANGE);
  EXPECT_THAT(bench.take(Kind::tell), IsEmpty());
}

TEST(GroupMoveMachine, WhoIsPreparedTooLateForTheOthersStartsNobody) {
  Bench bench;
  bench.expires = 100s + 300ms;
  bench.run_up_to(State::telling);
  EXPECT_EQ(bench.move.state(), State::giving_up);
  EXPECT_EQ(bench.move.value().cause().reason(), axisd::v1::REASON_EXPIRED);
  EXPECT_THAT(bench.take(Kind::tell), IsEmpty());
}

TEST(GroupMoveMachine, WhereNotAllAreToldInTimeNobodyStarts) {
  Bench bench;
  bench.run_up_to(State::telling);
  bench.take(Kind::tell);
  bench.add(bench.move.told(0, bench.answer(0, COMMAND_STATE_ACCEPTED)));
  bench.pass(GroupMoveMachine::lead / 2 - 50ms);
  EXPECT_EQ(bench.move.state(), State::telling);
  for (const auto& errand : bench.take(Kind::renew)) EXPECT_FALSE(errand.all_told);
  bench.pass(60ms);
  EXPECT_EQ(bench.move.state(), State::giving_up);
  EXPECT_EQ(bench.asked(Kind::cancel), (std::vector<std::size_t>{0}));
  EXPECT_THAT(bench.take(Kind::renew), IsEmpty());
  // What is under way changes nothing.
  bench.add(bench.move.told(1, bench.answer(1, COMMAND_STATE_ACCEPTED)));
  EXPECT_EQ(bench.move.state(), State::giving_up);
  EXPECT_EQ(bench.asked(Kind::cancel), (std::vector<std::size_t>{1}));
  EXPECT_THAT(bench.take(Kind::renew), IsEmpty());
}

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
  bench.add(bench.move.looked(1, bench.failure({grpc::StatusCode::UNAVAILABLE, "no route"})));
  bench.end(2, COMMAND_STATE_DONE);
  EXPECT_EQ(bench.move.state(), State::over);
  EXPECT_EQ(bench.move.value().state(), COMMAND_STATE_UNKNOWN);
  EXPECT_THAT(bench.asked(Kind::cancel), IsEmpty());
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
  for (const auto state : {State::measuring, State::telling}) {
    SCOPED_TRACE(static_cast<int>(state));
    Bench bench;
    bench.run_up_to(state);
    const auto slow = bench.failure({grpc::StatusCode::DEADLINE_EXCEEDED, "a slow link"});
    bench.add(state == State::measuring ? bench.move.measured(1, slow) : bench.move.told(1, slow));
    ASSERT_EQ(bench.move.state(), State::giving_up);
    EXPECT_THAT(bench.asked(Kind::cancel), IsEmpty());
    bench.add(bench.move.looked(0, bench.foreign(0, COMMAND_STATE_ACTIVE)));
    EXPECT_EQ(bench.move.state(), State::attached);
    bench.take(Kind::look);
    bench.take(Kind::measure);
    bench.take(Kind::tell);
    EXPECT_THAT(bench.wire, IsEmpty());
    for (std::size_t i = 0; i < 3; ++i) bench.add(bench.move.looked(i, bench.foreign(i, COMMAND_STATE_DONE)));
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

TEST(ClockSamples, TheOffsetIsInsideItsBound) {
  ClockSamples samples;
  EXPECT_FALSE(samples.at(TimePoint(1s)));
  // The other clock is 1000 s ahead; ways there and back are as unequal as they can be.
  for (const auto& [there, back] : {std::pair{3ms, 1ms}, {0ms, 400ms}, {2ms, 0ms}, {9ms, 0ms}}) {
    const TimePoint sent(10s);
    samples.add(sent, sent + there + back, (sent + there).time_since_epoch() + 1000s);
    const auto found = *samples.at(sent);
    EXPECT_LE(std::chrono::abs(found.offset - Duration(1000s)), found.error);
  }
  EXPECT_LT(samples.at(TimePoint(10s))->error, 1100us) << "by the shortest round trip";
  EXPECT_GT(samples.at(TimePoint(20s))->error, 2ms) << "they drift apart";
}

}  // namespace
}  // namespace axisd::cell
