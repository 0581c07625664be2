// What is told of moves of several machines.
#include "api/cell/group_move_steps.hpp"

#include <gmock/gmock.h>

#include "tests/unit/api/cell/group_move_bench.hpp"

namespace axisd::cell::group_move {
namespace {

using ::testing::ElementsAre;
constexpr auto prepared = v1::GROUP_MOVE_STEP_PREPARED, started = v1::GROUP_MOVE_STEP_STARTED,
               done = v1::GROUP_MOVE_STEP_DONE, failed = v1::GROUP_MOVE_STEP_FAILED,
               halted = v1::GROUP_MOVE_STEP_HALTED, unknown = v1::GROUP_MOVE_STEP_UNKNOWN;

class GroupMoveStepsTest : public ::testing::Test {
 protected:
  auto look() { return steps_.look(bench_.move); }
  void renew(std::size_t machine, axisd::v1::CommandState state) {
    bench_.add(bench_.move.renewed(machine, bench_.answer(machine, state)));
  }
  void start() {
    bench_.run_up_to(State::running);
    for (std::size_t i = 0; i < bench_.count; ++i) renew(i, COMMAND_STATE_ACTIVE);
  }

  Bench bench_{2};
  GroupMoveSteps steps_;
};

TEST_F(GroupMoveStepsTest, OfAMoveThatGoesWell) {
  EXPECT_THAT(look(), IsEmpty());
  bench_.prepare();
  EXPECT_THAT(look(), ElementsAre(prepared));
  bench_.measure();
  bench_.tell();
  EXPECT_THAT(look(), IsEmpty());
  renew(0, COMMAND_STATE_ACTIVE);
  EXPECT_THAT(look(), IsEmpty()) << "the other one waits";
  renew(1, COMMAND_STATE_ACTIVE);
  EXPECT_THAT(look(), ElementsAre(started));
  renew(0, COMMAND_STATE_DONE);
  EXPECT_THAT(look(), IsEmpty());
  renew(1, COMMAND_STATE_DONE);
  EXPECT_THAT(look(), ElementsAre(done));
  EXPECT_THAT(look(), IsEmpty());
}

/// It may be over at the first look after it has started.
TEST_F(GroupMoveStepsTest, OfAShortMoveNoneIsLeftOut) {
  bench_.run_up_to(State::running);
  EXPECT_THAT(look(), ElementsAre(prepared));
  for (std::size_t i = 0; i < 2; ++i) renew(i, COMMAND_STATE_DONE);
  EXPECT_EQ(bench_.move.state(), State::over);
  EXPECT_THAT(look(), ElementsAre(started, done));
}

TEST_F(GroupMoveStepsTest, ARefusalIsTheLastOne) {
  bench_.add(bench_.move.prepared(0, bench_.failure(refusal())));
  bench_.add(bench_.move.prepared(1, bench_.answer(1, COMMAND_STATE_ACCEPTED)));
  EXPECT_THAT(look(), ElementsAre(failed));
  bench_.release_waiting({1});
  EXPECT_EQ(bench_.move.state(), State::over);
  EXPECT_THAT(look(), IsEmpty()) << "nothing was started";
}

TEST_F(GroupMoveStepsTest, WhatFailsInMotionIsHalted) {
  start();
  EXPECT_THAT(look(), ElementsAre(prepared, started));
  renew(1, COMMAND_STATE_ABORTED);
  EXPECT_THAT(look(), ElementsAre(failed));
  bench_.end(0, COMMAND_STATE_ABORTED);
  EXPECT_THAT(look(), ElementsAre(halted));
}

TEST_F(GroupMoveStepsTest, WhereAMachineIsLostItIsNotKnown) {
  start();
  (void)look();
  bench_.add(bench_.move.renewed(0, bench_.failure({grpc::StatusCode::UNAVAILABLE, "gone"})));
  EXPECT_THAT(look(), ElementsAre(failed));
  bench_.end(1, COMMAND_STATE_ABORTED);
  bench_.pass(GroupMoveMachine::longest_end);
  EXPECT_EQ(bench_.move.state(), State::over);
  EXPECT_THAT(look(), ElementsAre(unknown));
}

TEST_F(GroupMoveStepsTest, OfAMoveOfAnotherEntranceWhatIsSeen) {
  for (std::size_t i = 0; i < 2; ++i)
    bench_.add(bench_.move.prepared(i, bench_.foreign(i, COMMAND_STATE_ACTIVE)));
  EXPECT_THAT(look(), ElementsAre(started));
  bench_.add(bench_.move.looked(0, bench_.foreign(0, COMMAND_STATE_DONE)));
  EXPECT_THAT(look(), IsEmpty());
  bench_.add(bench_.move.looked(1, bench_.foreign(1, COMMAND_STATE_ABORTED)));
  EXPECT_THAT(look(), ElementsAre(failed, halted));
}

TEST_F(GroupMoveStepsTest, WhatWasDoneBeforeIsNoNews) {
  for (std::size_t i = 0; i < 2; ++i)
    bench_.add(bench_.move.prepared(i, bench_.answer(i, COMMAND_STATE_DONE)));
  EXPECT_EQ(bench_.move.state(), State::over);
  EXPECT_THAT(look(), IsEmpty());
}

TEST(GroupMoveEvent, TellsWhoMovesWhatAndHowWell) {
  v1::CellGroupMove move;
  for (const auto& name : Bench::names(6)) move.add_machines()->set_machine(name);
  set_duration(*move.mutable_start_skew(), 250us);
  set_duration(*move.mutable_start_skew_error(), 70us);
  auto event = event_of(started, move, "anna", "r-1");
  EXPECT_EQ(event.kind(), v1::CELL_EVENT_KIND_GROUP_MOVE);
  EXPECT_EQ(event.text(),
            "move of press-1, press-2, press-3, press-4 and 2 more by anna: started, skew 0.250 ms, off by "
            "0.070 ms at most");
  EXPECT_EQ(event.group_move().machines_size(), 6);
  EXPECT_EQ(duration_of(event.group_move().start_skew()), Duration(250us));
  EXPECT_FALSE(event.group_move().has_cause());
  move.mutable_cause()->set_message("press-2: arm: alarm 7");
  event = event_of(failed, move, "anna", "r-1");
  EXPECT_THAT(event.text(), HasSubstr("by anna: failed: press-2: arm: alarm 7"));
  EXPECT_EQ(event.group_move().cause().message(), "press-2: arm: alarm 7");
  EXPECT_FALSE(event.group_move().has_start_skew());
}

}  // namespace
}  // namespace axisd::cell::group_move
