// Held stops, their release, and the list of commands, as a client sees them.
#include <gmock/gmock.h>

#include "axisd/v1/command_service.grpc.pb.h"
#include "tests/unit/api/serving.hpp"

namespace axisd::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;

class HoldCalls : public Serving {};

TEST_F(HoldCalls, AReleaseSaysWhoseHoldsAreToEnd) {
  serve();
  const auto release = [&](auto edit) {
    Call context;
    v1::ReleaseStopRequest request;
    request.set_axis("feeder");
    edit(request);
    v1::ReleaseStopResponse response;
    return axes_->ReleaseStop(&context, request, &response);
  };
  EXPECT_TRUE(release([](auto& r) { r.set_request_id("r-1"); }).ok());
  EXPECT_TRUE(release([](auto& r) { r.set_mine(true); }).ok());
  EXPECT_TRUE(release([](auto& r) {
                r.set_everybody(true);
                r.set_lease_token(9);
              }).ok());
  EXPECT_THAT(machine_.log(), ElementsAre("release_stop feeder by " + own_name() + " as r-1 whose 0 token 0",
                                          "release_stop feeder by " + own_name() + " as  whose 1 token 0",
                                          "release_stop feeder by " + own_name() + " as  whose 2 token 9"));
  for (const auto& status : {release([](auto& r) {
                               r.set_request_id("r-1");
                               r.set_everybody(true);
                             }),
                             release([](auto& r) {
                               r.set_mine(true);
                               r.set_everybody(true);
                             }),
                             release([](auto& r) { r.set_request_id("two words"); })})
    EXPECT_EQ(detail_of(status).reason(), v1::REASON_INVALID_ARGUMENT);
  EXPECT_EQ(machine_.log().size(), 3U);
}

TEST_F(HoldCalls, AHeldStopSaysWhoHolds) {
  AxisSnapshot held{.name = "feeder"};
  held.holds = {{.key = {.holder = "panel", .request_id = "p-1"}}};
  machine_.publish(std::move(held));
  serve();
  const auto stop = [&](bool hold) {
    Call context;
    v1::StopRequest request;
    request.set_axis("feeder");
    request.set_hold(hold);
    request.mutable_options()->set_request_id("r-1");
    v1::StopResponse response;
    EXPECT_TRUE(axes_->Stop(&context, request, &response).ok());
    return response;
  };
  const auto answer = stop(true);
  ASSERT_EQ(answer.holds_size(), 1);
  EXPECT_EQ(answer.holds(0).holder(), "panel");
  EXPECT_EQ(stop(false).holds_size(), 0);
  EXPECT_EQ(machine_.submitted().at(0).options.request_id, "r-1");
}

TEST_F(HoldCalls, CommandsAreListed) {
  machine_.publish({.name = "feeder"});
  serve();
  const auto commands = v1::CommandService::NewStub(channel_);
  const auto list = [&](const std::string& axis, std::uint32_t limit, v1::ListCommandsResponse& response) {
    Call context;
    v1::ListCommandsRequest request;
    request.set_axis(axis);
    request.set_limit(limit);
    return commands->ListCommands(&context, request, &response);
  };
  v1::ListCommandsResponse response;
  ASSERT_TRUE(list("", 0, response).ok());
  ASSERT_EQ(response.commands_size(), 2);
  EXPECT_EQ(response.commands(0).id(), "c-2");
  EXPECT_EQ(response.commands(0).client(), "hmi");
  EXPECT_TRUE(list("feeder", 500, response).ok());
  EXPECT_THAT(machine_.log(), ElementsAre("list_commands  20", "list_commands feeder 500"));
  EXPECT_EQ(detail_of(list("feedr", 0, response)).reason(), v1::REASON_UNKNOWN_AXIS);
  EXPECT_EQ(detail_of(list("", 501, response)).reason(), v1::REASON_OUT_OF_RANGE);
}

}  // namespace
}  // namespace axisd::testing
