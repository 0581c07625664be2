// GroupService through a real connection.
#include <gmock/gmock.h>

#include <limits>

#include "axisd/v1/group_service.grpc.pb.h"
#include "tests/unit/api/serving.hpp"

namespace axisd::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class GroupCalls : public Serving {
 protected:
  void SetUp() override {
    serve();
    groups_ = v1::GroupService::NewStub(channel_);
    auto& target = *request_.add_targets();
    target.set_axis("feeder");
    target.set_position(0);
    request_.mutable_options()->set_request_id("r-1");
  }
  grpc::Status move() {
    Call context;
    return groups_->MoveGroup(&context, request_, &response_);
  }
  void refused(std::string_view text) {
    const auto status = move();
    EXPECT_EQ(detail_of(status).reason(), v1::REASON_INVALID_ARGUMENT);
    EXPECT_THAT(status.error_message(), HasSubstr(text));
  }

  std::unique_ptr<v1::GroupService::Stub> groups_;
  v1::MoveGroupRequest request_;
  v1::MoveGroupResponse response_;
};

TEST_F(GroupCalls, MoveCarriesEverythingBothWays) {
  request_.set_group("gantry");
  auto& other = *request_.add_targets();
  other.set_axis("turntable");
  other.set_distance(-5);
  request_.set_arrive_together(true);
  request_.mutable_max_arrival_error()->set_nanos(3'000'000);
  request_.mutable_options()->set_wait_until(v1::WAIT_UNTIL_DONE);
  ASSERT_TRUE(move().ok());
  EXPECT_THAT(machine_.groups().log(),
              ElementsAre("move gantry feeder=0 turntable+=-5 together true within 3 by " + own_name() +
                          " as r-1 until 2"));
  const auto& got = response_.move();
  EXPECT_EQ(got.id(), "g-1");
  EXPECT_EQ(got.group(), "gantry");
  EXPECT_EQ(got.state(), v1::COMMAND_STATE_DONE);
  EXPECT_TRUE(got.arrive_together());
  EXPECT_EQ(got.start_skew().nanos(), 5'000'000);
  EXPECT_EQ(got.arrival_error().nanos(), 7'000'000);
  EXPECT_EQ(got.predicted_arrival_error().nanos(), 1'000'000);
  ASSERT_EQ(got.members_size(), 1);
  EXPECT_EQ(got.members(0).command().axis(), "feeder");
  EXPECT_TRUE(got.members(0).by_sync());
  EXPECT_EQ(got.members(0).start_note(), "no");
  EXPECT_TRUE(got.members(0).has_started_after());
  EXPECT_EQ(got.members(0).arrived_after().seconds(), 1);
}

TEST_F(GroupCalls, MalformedRequestsAreRefusedHere) {
  auto& target = *request_.mutable_targets(0);
  target.clear_position();
  refused("neither position nor distance");
  target.set_position(std::numeric_limits<double>::quiet_NaN());
  refused("finite");
  target.set_position(1);
  target.set_axis("No");
  refused("No");
  target.set_axis("feeder");
  request_.mutable_max_arrival_error()->set_seconds(-1);
  refused("max_arrival_error");
  request_.clear_max_arrival_error();
  request_.mutable_options()->clear_request_id();
  refused("request_id");
}

TEST_F(GroupCalls, APreparedMoveIsStartedAndRenewedByItsId) {
  Call context;
  v1::PrepareMoveRequest wanted;
  *wanted.mutable_move() = request_;
  v1::PrepareMoveResponse prepared;
  ASSERT_TRUE(groups_->PrepareMove(&context, wanted, &prepared).ok());
  const auto& found = prepared.move().preparation();
  EXPECT_EQ(prepared.move().state(), v1::COMMAND_STATE_ACCEPTED);
  EXPECT_EQ(found.expires().seconds(), 9);
  EXPECT_EQ(found.notice().nanos(), 80'000'000);
  EXPECT_EQ(found.predicted_start_skew().nanos(), 4'000'000);
  EXPECT_EQ(found.first_start().seconds(), 8);
  EXPECT_FALSE(found.has_starts_at());
  EXPECT_TRUE(prepared.has_clock());

  Call second;
  v1::StartPreparedRequest start;
  start.set_id("g-1");
  start.mutable_at()->set_seconds(8);
  start.mutable_at()->set_nanos(500'000'000);
  start.set_wait_until(v1::WAIT_UNTIL_STARTED);
  v1::StartPreparedResponse started;
  ASSERT_TRUE(groups_->StartPrepared(&second, start, &started).ok());
  EXPECT_EQ(started.move().preparation().starts_at().nanos(), 500'000'000);
  EXPECT_TRUE(started.has_clock());

  Call third;
  v1::RenewPreparedRequest renew;
  renew.set_id("g-1");
  renew.set_all_told(true);
  v1::RenewPreparedResponse renewed;
  ASSERT_TRUE(groups_->RenewPrepared(&third, renew, &renewed).ok());
  EXPECT_EQ(renewed.move().id(), "g-1");
  EXPECT_TRUE(renewed.move().has_preparation());
  EXPECT_TRUE(renewed.move().members().empty()) << "they are told once it has ended";
  EXPECT_TRUE(renewed.has_clock());

  Call fourth;
  renew.set_id("g-done");
  ASSERT_TRUE(groups_->RenewPrepared(&fourth, renew, &renewed).ok());
  EXPECT_EQ(renewed.move().members_size(), 1);
  EXPECT_THAT(machine_.groups().log(),
              ElementsAre("prepare  feeder=0 together false within -1 by " + own_name() + " as r-1 until 0",
                          "start g-1 at 8500 by " + own_name() + " until 1",
                          "renew g-1 by " + own_name() + ", all told",
                          "renew g-done by " + own_name() + ", all told"));
}

TEST_F(GroupCalls, MalformedPreparationsAreRefusedHere) {
  v1::PrepareMoveRequest wanted;
  *wanted.mutable_move() = request_;
  wanted.mutable_move()->mutable_options()->set_wait_until(v1::WAIT_UNTIL_DONE);
  v1::PrepareMoveResponse prepared;
  Call context;
  EXPECT_THAT(groups_->PrepareMove(&context, wanted, &prepared).error_message(), HasSubstr("wait_until"));
  const auto refused = [&](const v1::StartPreparedRequest& start) {
    Call each;
    v1::StartPreparedResponse started;
    const auto status = groups_->StartPrepared(&each, start, &started);
    EXPECT_EQ(detail_of(status).reason(), v1::REASON_INVALID_ARGUMENT);
    return status.error_message();
  };
  v1::StartPreparedRequest start;
  start.mutable_at()->set_seconds(5);
  EXPECT_THAT(refused(start), HasSubstr("id"));
  start.set_id("g-1");
  start.clear_at();
  EXPECT_THAT(refused(start), HasSubstr("at is no moment"));
  start.mutable_at()->set_seconds(-5);
  EXPECT_THAT(refused(start), HasSubstr("at is no moment"));
  start.mutable_at()->set_seconds(5);
  start.set_wait_until(static_cast<v1::WaitUntil>(77));
  EXPECT_THAT(refused(start), HasSubstr("wait_until"));
  EXPECT_THAT(machine_.groups().log(), ::testing::IsEmpty());
}

TEST_F(GroupCalls, ListsAndGets) {
  Call context;
  v1::ListGroupsResponse listed;
  ASSERT_TRUE(groups_->ListGroups(&context, {}, &listed).ok());
  ASSERT_EQ(listed.groups_size(), 1);
  EXPECT_EQ(listed.groups(0).name(), "gantry");
  EXPECT_THAT(listed.groups(0).axes(), ElementsAre("feeder", "table"));
  EXPECT_EQ(listed.groups(0).max_arrival_error().nanos(), 20'000'000);
  Call second;
  v1::GetGroupMoveRequest request;
  request.set_id("g-9");
  v1::GetGroupMoveResponse got;
  ASSERT_TRUE(groups_->GetGroupMove(&second, request, &got).ok());
  EXPECT_EQ(got.move().id(), "g-9");
}

TEST_F(GroupCalls, StopsTellOfEachNameAndNeverFailForOne) {
  Call context;
  v1::GroupStopRequest request;
  request.set_group("gantry");
  request.add_axes("feeder");
  request.add_axes("nobody");
  request.set_hold(true);
  request.set_request_id("r-1");
  request.set_wait_until(v1::WAIT_UNTIL_DONE);
  v1::GroupStopResponse response;
  ASSERT_TRUE(groups_->GroupStop(&context, request, &response).ok());
  EXPECT_THAT(machine_.groups().log(),
              ElementsAre("stop gantry feeder+nobody kind 2 hold true as r-1 by " + own_name() + " until 2"));
  ASSERT_EQ(response.results_size(), 2);
  EXPECT_EQ(response.results(0).command().axis(), "feeder");
  EXPECT_EQ(response.results(1).error().reason(), v1::REASON_UNKNOWN_AXIS);

  Call halting;
  v1::GroupHaltRequest halt;
  halt.add_axes("nobody");
  v1::GroupHaltResponse halted;
  EXPECT_EQ(detail_of(groups_->GroupHalt(&halting, halt, &halted)).reason(), v1::REASON_UNKNOWN_AXIS);
  Call empty;
  EXPECT_EQ(detail_of(groups_->GroupHalt(&empty, {}, &halted)).reason(), v1::REASON_INVALID_ARGUMENT);
}

TEST_F(GroupCalls, AStopIsNeverRefusedForItsRequestId) {
  Call context;
  v1::GroupStopRequest request;
  request.add_axes("feeder");
  request.set_hold(true);
  request.set_request_id("two words");
  v1::GroupStopResponse response;
  ASSERT_TRUE(groups_->GroupStop(&context, request, &response).ok());
  EXPECT_THAT(machine_.groups().log(),
              ElementsAre("stop  feeder kind 2 hold true by " + own_name() + " until 0"));
}

TEST_F(GroupCalls, ReleasesTellOfEachName) {
  Call context;
  v1::GroupReleaseStopRequest request;
  request.add_axes("feeder");
  request.add_axes("nobody");
  request.set_request_id("r-1");
  v1::GroupReleaseStopResponse response;
  ASSERT_TRUE(groups_->GroupReleaseStop(&context, request, &response).ok());
  EXPECT_THAT(machine_.groups().log(),
              ElementsAre("release  feeder+nobody by " + own_name() + " as r-1 whose 0 token 0"));
  ASSERT_EQ(response.results_size(), 2);
  ASSERT_EQ(response.results(0).holds_size(), 1);
  EXPECT_EQ(response.results(0).holds(0).holder(), "hmi");
  EXPECT_EQ(response.results(1).error().reason(), v1::REASON_UNKNOWN_AXIS);

  Call nothing;
  v1::GroupReleaseStopRequest nobody;
  nobody.add_axes("nobody");
  EXPECT_EQ(detail_of(groups_->GroupReleaseStop(&nothing, nobody, &response)).reason(),
            v1::REASON_UNKNOWN_AXIS);
  Call empty;
  EXPECT_EQ(detail_of(groups_->GroupReleaseStop(&empty, {}, &response)).reason(),
            v1::REASON_INVALID_ARGUMENT);
}

}  // namespace
}  // namespace axisd::testing
