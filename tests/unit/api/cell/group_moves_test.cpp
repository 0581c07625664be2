// Moves of several machines at an entrance: who may ask for them, how much, and what they are told.
#include "api/cell/group_moves.hpp"

#include <gmock/gmock.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "api/cell/status.hpp"
#include "axisd/v1/group_service.grpc.pb.h"
#include "buses/asio_clock.hpp"

namespace axisd::cell {
namespace {

using namespace std::chrono_literals;
using grpc::StatusCode;
using ::testing::HasSubstr;

/// An axisd at which every request is a move that another entrance has started.
class Moving final : public axisd::v1::GroupService::Service {
 public:
  std::atomic<axisd::v1::CommandState> state = axisd::v1::COMMAND_STATE_ACTIVE;

 private:
  grpc::Status PrepareMove(grpc::ServerContext*, const axisd::v1::PrepareMoveRequest*,
                           axisd::v1::PrepareMoveResponse* response) override {
    fill(*response->mutable_move());
    return grpc::Status::OK;
  }
  grpc::Status GetGroupMove(grpc::ServerContext*, const axisd::v1::GetGroupMoveRequest*,
                            axisd::v1::GetGroupMoveResponse* response) override {
    fill(*response->mutable_move());
    return grpc::Status::OK;
  }
  void fill(axisd::v1::GroupMove& move) const {
    move.set_id("g-1");
    move.set_state(state);
    move.mutable_preparation()->mutable_starts_at()->set_seconds(7);
  }
};

class GroupMovesTest : public ::testing::Test {
 protected:
  GroupMovesTest() {
    grpc::ServerBuilder builder;
    builder.RegisterService(&service_);
    server_ = builder.BuildAndStart();
    auto routes = std::make_shared<Routes>();
    routes->machines["press-1"] = {.way = {.main = server_->InProcessChannel({})}, .open = true};
    routes->machines["press-2"] = {.open = false, .why = "it does not answer"};
    table_.replace(std::move(routes));
    request_.mutable_options()->set_request_id("r-1");
    request_.mutable_options()->set_wait_until(axisd::v1::WAIT_UNTIL_DONE);
    add("press-1");
  }
  ~GroupMovesTest() override {
    moves_.end(grpc::Status::CANCELLED);
    EXPECT_TRUE(run_until([] { return open_asks() == 0; }));
    server_->Shutdown();
  }

  void add(const std::string& machine, const std::string& axis = "feeder") {
    auto& part = *request_.add_machines();
    part.set_machine(machine);
    auto& target = *part.add_targets();
    target.set_axis(axis);
    target.set_position(10);
  }
  template <class Condition>
  bool run_until(Condition condition) {
    for (int i = 0; i < 1000 && !condition(); ++i) {
      io_.restart();
      io_.run_for(10ms);
    }
    return condition();
  }
  void ask(const Caller& caller = {.name = "local", .local = true}) {
    answer_.reset();
    moves_.move(caller, request_, TimePoint::max(),
                [this](const grpc::Status& status, const v1::MoveGroupResponse& response) {
                  answer_ = status;
                  move_ = response.move();
                });
  }
  void expect_refused(StatusCode code, const std::string& text,
                      const Caller& caller = {.name = "local", .local = true}) {
    ask(caller);
    ASSERT_TRUE(answer_) << text << ": it was accepted";
    EXPECT_EQ(answer_->error_code(), code) << answer_->error_message();
    EXPECT_THAT(answer_->error_message(), HasSubstr(text));
    EXPECT_EQ(moves_.open(), 0);
  }

  boost::asio::io_context io_;
  AsioClock clock_{io_};
  RouteTable table_{"press-1"};
  Moving service_;
  std::unique_ptr<grpc::Server> server_;
  std::vector<v1::CellEvent> told_;
  GroupMoves moves_{io_.get_executor(), clock_, table_,
                    [this](v1::CellEvent event) { told_.push_back(std::move(event)); }};
  v1::MoveGroupRequest request_;
  std::optional<grpc::Status> answer_;
  v1::CellGroupMove move_;
};

TEST_F(GroupMovesTest, OnlyOperatorsMove) {
  expect_refused(StatusCode::PERMISSION_DENIED, "has the role viewer", {.name = "panel"});
  EXPECT_EQ(detail_of(*answer_).reason(), axisd::v1::REASON_ACCESS_DENIED);
  ask({.name = "panel", .role = CellRole::operator_});
  EXPECT_FALSE(answer_) << "it is under way";
  EXPECT_EQ(moves_.open(), 1);
}

TEST_F(GroupMovesTest, NoRequestIsTooLarge) {
  const auto good = request_;
  for (int i = 0; i < GroupMoves::most_targets; ++i)
    *request_.mutable_machines(0)->add_targets() = good.machines(0).targets(0);
  expect_refused(StatusCode::INVALID_ARGUMENT, "1025 targets");
  request_ = good;
  request_.mutable_machines(0)->mutable_targets(0)->set_axis(std::string(65, 'a'));
  expect_refused(StatusCode::INVALID_ARGUMENT, "65 bytes");
  request_ = good;
  request_.mutable_machines(0)->set_machine(std::string(65, 'a'));
  expect_refused(StatusCode::INVALID_ARGUMENT, "no machine's name");
  request_ = good;
  // What a later contract may have.
  request_.GetReflection()->MutableUnknownFields(&request_)->AddLengthDelimited(1000,
                                                                                std::string(300'000, 'a'));
  expect_refused(StatusCode::INVALID_ARGUMENT, "the request has 300");
}

TEST_F(GroupMovesTest, AToleranceIsATime) {
  const auto most = std::numeric_limits<std::int64_t>::max();
  for (const auto& [seconds, nanos] : {std::pair{most, 999'999'999},
                                       {-most, 0},
                                       {2, 0},
                                       {1, 1},
                                       {0, 0},
                                       {1, -1},
                                       {0, 1'000'000'000},
                                       {-1, 999'999'999}}) {
    request_.mutable_clock_tolerance()->set_seconds(seconds);
    request_.mutable_clock_tolerance()->set_nanos(nanos);
    expect_refused(StatusCode::INVALID_ARGUMENT, "clock_tolerance");
  }
}

/// The same request may run already, through another entrance.
TEST_F(GroupMovesTest, OfAMachineThatCannotBeAskedOnlyThisEntrancesShareIsTold) {
  add("press-2");
  expect_refused(StatusCode::UNAVAILABLE, "press-2: it does not answer");
  EXPECT_THAT(detail_of(*answer_).remedy(), HasSubstr("nothing was sent by this entrance"));
}

TEST_F(GroupMovesTest, OtherContentUnderTheSameIdIsRefused) {
  ask();
  request_.mutable_options()->set_wait_until(axisd::v1::WAIT_UNTIL_ACCEPTED);
  ask();
  EXPECT_TRUE(run_until([&] { return answer_.has_value(); }));
  EXPECT_TRUE(answer_->ok()) << "the same, but for how long it waits";
  request_.mutable_machines(0)->mutable_targets(0)->set_position(11);
  ask();
  ASSERT_TRUE(answer_);
  EXPECT_EQ(answer_->error_code(), StatusCode::ALREADY_EXISTS);
}

TEST_F(GroupMovesTest, HowMovesEndIsCounted) {
  ask();
  EXPECT_EQ(moves_.open(), 1);
  service_.state = axisd::v1::COMMAND_STATE_DONE;
  EXPECT_TRUE(run_until([&] { return answer_.has_value(); }));
  EXPECT_EQ(move_.state(), axisd::v1::COMMAND_STATE_DONE);
  ask();
  EXPECT_TRUE(answer_) << "it is known";
  service_.state = axisd::v1::COMMAND_STATE_ABORTED;
  request_.mutable_options()->set_request_id("r-2");
  ask();
  EXPECT_TRUE(run_until([&] { return answer_.has_value(); }));
  EXPECT_EQ(moves_.open(), 0);
  EXPECT_EQ(moves_.tally().done, 1U);
  EXPECT_EQ(moves_.tally().otherwise, 1U);
  EXPECT_EQ(moves_.tally().unknown + moves_.tally().refused, 0U);
}

TEST_F(GroupMovesTest, ItIsToldHowAMoveComesAlong) {
  ask({.name = "anna", .role = CellRole::operator_});
  EXPECT_TRUE(run_until([&] { return !told_.empty(); }));
  service_.state = axisd::v1::COMMAND_STATE_DONE;
  EXPECT_TRUE(run_until([&] { return answer_.has_value(); }));
  ASSERT_EQ(told_.size(), 2U);
  EXPECT_EQ(told_[0].kind(), v1::CELL_EVENT_KIND_GROUP_MOVE);
  EXPECT_EQ(told_[0].group_move().step(), v1::GROUP_MOVE_STEP_STARTED);
  EXPECT_EQ(told_[0].group_move().request_id(), "r-1");
  EXPECT_EQ(told_[0].text(), "move of press-1 by anna: started");
  EXPECT_EQ(told_[1].group_move().step(), v1::GROUP_MOVE_STEP_DONE);
  ask({.name = "anna", .role = CellRole::operator_});
  EXPECT_TRUE(answer_) << "it is known";
  EXPECT_EQ(told_.size(), 2U) << "a repeat is no other move";
}

TEST_F(GroupMovesTest, NotMoreIsRememberedThanFits) {
  service_.state = axisd::v1::COMMAND_STATE_DONE;
  while (request_.machines(0).targets_size() < GroupMoves::most_targets)
    *request_.mutable_machines(0)->add_targets() = request_.machines(0).targets(0);
  constexpr int fit = GroupMoves::most_ended_targets / GroupMoves::most_targets;
  const auto ask_for = [this](int number) {
    request_.mutable_options()->set_request_id("r-" + std::to_string(number));
    ask();
    const bool at_once = answer_.has_value();
    EXPECT_TRUE(run_until([&] { return answer_.has_value(); }));
    return at_once;
  };
  for (int i = 0; i <= fit + 1; ++i) EXPECT_FALSE(ask_for(i)) << "it is new";
  EXPECT_TRUE(ask_for(fit + 1));
  EXPECT_TRUE(ask_for(2)) << "it is remembered";
  EXPECT_FALSE(ask_for(0)) << "its machine is asked";
}

TEST_F(GroupMovesTest, AtItsEndItIsToldWhetherAnythingMayHaveMoved) {
  const grpc::Status why(StatusCode::UNAVAILABLE, "shutting down");
  ask();
  EXPECT_FALSE(answer_);
  moves_.end(why);
  ASSERT_TRUE(answer_);
  EXPECT_EQ(answer_->error_message(), "shutting down") << "nobody has answered yet";

  request_.mutable_options()->set_wait_until(axisd::v1::WAIT_UNTIL_ACCEPTED);
  ask();
  EXPECT_TRUE(run_until([&] { return answer_.has_value(); })) << "it is known that it moves";
  EXPECT_EQ(move_.state(), axisd::v1::COMMAND_STATE_ACTIVE);
  request_.mutable_options()->set_wait_until(axisd::v1::WAIT_UNTIL_DONE);
  ask();
  EXPECT_FALSE(answer_);
  moves_.end(why);
  ASSERT_TRUE(answer_);
  EXPECT_EQ(answer_->error_code(), StatusCode::UNAVAILABLE);
  EXPECT_THAT(answer_->error_message(), HasSubstr("may have run in part"));
}

}  // namespace
}  // namespace axisd::cell
