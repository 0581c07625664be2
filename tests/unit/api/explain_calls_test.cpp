// SystemService.Explain through a real connection.
#include <gmock/gmock.h>

#include "axisd/v1/system_service.grpc.pb.h"
#include "tests/unit/api/serving.hpp"

namespace axisd::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class ExplainCalls : public Serving {
 protected:
  void SetUp() override {
    machine_.publish({.name = "feeder"});
    serve();
    system_ = v1::SystemService::NewStub(channel_);
    request_.set_axis("feeder");
  }
  grpc::Status explain() {
    Call context;
    response_.Clear();
    return system_->Explain(&context, request_, &response_);
  }
  void refused(v1::Reason reason, std::string_view text) {
    const auto status = explain();
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(detail_of(status).reason(), reason);
    EXPECT_THAT(status.error_message(), HasSubstr(text));
  }

  std::unique_ptr<v1::SystemService::Stub> system_;
  v1::ExplainRequest request_;
  v1::ExplainResponse response_;
};

TEST_F(ExplainCalls, TheListComesWhole) {
  request_.mutable_move_absolute()->set_position(500);
  ASSERT_TRUE(explain().ok());
  ASSERT_EQ(response_.obstacles_size(), 2);
  const auto& first = response_.obstacles(0);
  EXPECT_TRUE(first.blocking());
  EXPECT_EQ(first.detail().reason(), v1::REASON_SOFT_LIMIT);
  EXPECT_EQ(first.detail().remedy(), "stay within");
  EXPECT_EQ(first.detail().permitted().maximum(), 400);
  EXPECT_FALSE(response_.obstacles(1).blocking());
  EXPECT_THAT(machine_.submitted(), IsEmpty());
}

TEST_F(ExplainCalls, EachCommandIsAskedAboutUnderItsLease) {
  const auto ask = [&](auto fill) {
    request_.Clear();
    request_.set_axis("feeder");
    request_.set_lease_token(7);
    fill();
    ASSERT_TRUE(explain().ok());
  };
  ask([] {});
  ask([&] { request_.mutable_enable(); });
  ask([&] { request_.mutable_disable(); });
  ask([&] { request_.mutable_home()->mutable_options()->set_lease_token(9); });
  ask([&] { request_.mutable_move_absolute()->set_position(0); });
  ask([&] { request_.mutable_move_relative()->set_distance(0); });
  ask([&] { request_.mutable_move_velocity()->set_velocity(0); });
  ask([&] { request_.mutable_jog()->set_velocity(0); });
  ask([&] { request_.mutable_reset(); });
  ask([&] { request_.mutable_set_position()->set_position(0); });
  EXPECT_THAT(machine_.log(), ElementsAre("explain feeder motion by " + own_name() + " token 7",
                                          "explain feeder enable by " + own_name() + " token 7",
                                          "explain feeder disable by " + own_name() + " token 0",
                                          "explain feeder home by " + own_name() + " token 9",
                                          "explain feeder move_absolute by " + own_name() + " token 7",
                                          "explain feeder move_relative by " + own_name() + " token 7",
                                          "explain feeder move_velocity by " + own_name() + " token 7",
                                          "explain feeder jog by " + own_name() + " token 7",
                                          "explain feeder reset by " + own_name() + " token 7",
                                          "explain feeder set_position by " + own_name() + " token 7"));
}

TEST_F(ExplainCalls, WhatTheCommandItselfWouldBeRefusedForHereIsRefusedHere) {
  request_.mutable_move_absolute();
  refused(v1::REASON_INVALID_ARGUMENT, "position");
  request_.mutable_move_absolute()->set_position(1);
  request_.mutable_move_absolute()->set_axis("turntable");
  refused(v1::REASON_INVALID_ARGUMENT, "another axis");
  request_.mutable_move_absolute()->set_axis("feeder");
  request_.mutable_move_absolute()->mutable_options()->mutable_not_after()->set_seconds(1);
  refused(v1::REASON_EXPIRED, "not_after");
  request_.set_axis("nobody");
  refused(v1::REASON_UNKNOWN_AXIS, "nobody");
  EXPECT_THAT(machine_.log(), IsEmpty());
}

}  // namespace
}  // namespace axisd::testing
