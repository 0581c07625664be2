#include "api/axisctl/machine_names.hpp"

#include <gmock/gmock.h>

#include "api/axisctl/error.hpp"
#include "axisd/v1/bus_service.pb.h"
#include "axisd/v1/command_service.pb.h"
#include "axisd/v1/drive_service.pb.h"
#include "axisd/v1/group_service.pb.h"
#include "axisd/v1/system_service.pb.h"

namespace axisd::axisctl {
namespace {

using testing::HasSubstr;

std::string text_of_usage(google::protobuf::Message& request) {
  try {
    static_cast<void>(take_machine(request));
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.code(), ExitCode::usage);
    return failure.what();
  }
  return "";
}

TEST(MachineNames, HaveTheMachineInFront) {
  EXPECT_EQ(machine_in("press-2/feeder"), "press-2");
  EXPECT_EQ(machine_in("feeder"), "");
  EXPECT_EQ(without_machine("press-2/feeder"), "feeder");
  EXPECT_EQ(without_machine("feeder"), "feeder");
  EXPECT_EQ(as_file_name("press-2/feeder"), "press-2-feeder");
}

TEST(MachineNames, AreTakenOffWhereverARequestHasThem) {
  v1::MoveGroupRequest request;
  request.set_group("press-2/transfer");
  request.add_targets()->set_axis("press-2/feeder");
  request.mutable_options()->set_request_id("a/b");  // no name of anything
  const auto named = take_machine(request);
  EXPECT_EQ(named.machine, "press-2");
  EXPECT_EQ(named.bare, std::nullopt);
  EXPECT_EQ(request.group(), "transfer");
  EXPECT_EQ(request.targets(0).axis(), "feeder");
  EXPECT_EQ(request.options().request_id(), "a/b");

  v1::WatchAxesRequest watch;
  watch.add_axes("press-1/a");
  watch.add_axes("press-1/b");
  EXPECT_EQ(take_machine(watch).machine, "press-1");
  EXPECT_THAT(watch.axes(), testing::ElementsAre("a", "b"));

  v1::GetCommandRequest command;
  command.set_id("press-1/4f-12");
  EXPECT_EQ(take_machine(command).machine, "press-1");
  EXPECT_EQ(command.id(), "4f-12");

  // A parameter may be called as it likes.
  v1::ReadParametersRequest parameters;
  parameters.set_axis("press-1/a");
  parameters.add_names("x/y");
  EXPECT_EQ(take_machine(parameters).machine, "press-1");
  EXPECT_EQ(parameters.names(0), "x/y");
}

TEST(MachineNames, AreConfirmedWithTheMachineOrWithout) {
  v1::RestoreFactoryRequest request;
  request.set_axis("press-1/feeder");
  request.set_confirm("press-1/feeder");
  EXPECT_EQ(take_machine(request).machine, "press-1");
  EXPECT_EQ(request.confirm(), "feeder");
  request.set_axis("press-1/feeder");
  EXPECT_EQ(take_machine(request).bare, std::nullopt);
  EXPECT_EQ(request.confirm(), "feeder");
  request.set_axis("press-1/feeder");
  request.set_confirm("press-2/feeder");
  EXPECT_THAT(text_of_usage(request), HasSubstr("two machines"));
}

TEST(MachineNames, OfSeveralMachinesAreNoRequest) {
  v1::WatchAxesRequest request;
  request.add_axes("press-1/a");
  request.add_axes("press-2/b");
  EXPECT_THAT(text_of_usage(request), HasSubstr("press-1 and press-2 are two machines"));
}

TEST(MachineNames, ThatAreMissingAreTold) {
  v1::WatchAxesRequest request;
  request.add_axes("press-1/a");
  request.add_axes("b");
  const auto named = take_machine(request);
  EXPECT_EQ(named.machine, "press-1");
  EXPECT_EQ(named.bare, "b");
  v1::ListCommandsRequest nothing;
  EXPECT_EQ(take_machine(nothing).machine, "");
  EXPECT_EQ(take_machine(nothing).bare, std::nullopt);
}

TEST(MachineNames, TokensOfLeasesAreFoundAndDropped) {
  v1::MoveGroupRequest move;
  EXPECT_FALSE(has_lease_token(move));
  move.mutable_options()->set_request_id("a");
  EXPECT_FALSE(has_lease_token(move));
  move.mutable_options()->set_lease_token(7);
  EXPECT_TRUE(has_lease_token(move));
  drop_lease_token(move);
  EXPECT_FALSE(has_lease_token(move));
  EXPECT_EQ(move.options().request_id(), "a");
  v1::SaveParametersRequest save;
  save.set_lease_token(7);
  EXPECT_TRUE(has_lease_token(save));
  drop_lease_token(save);
  EXPECT_EQ(save.lease_token(), 0);
}

TEST(MachineNames, CannotBeAnything) {
  v1::StopRequest request;
  for (const auto* wrong : {"/feeder", "press-1/", "Press/a", "pr\xC3\xA9sse/a", "1/a", "a b/c"}) {
    request.set_axis(wrong);
    EXPECT_NE(text_of_usage(request), "") << wrong;
  }
}

TEST(MachineNames, ArePutBeforeAllNamesOfAnAnswer) {
  v1::StopAllResponse response;
  auto& result = *response.add_results();
  result.set_axis("feeder");
  result.mutable_command()->set_id("4f-12");
  result.mutable_command()->set_axis("feeder");
  result.mutable_command()->set_client("anna");
  put_machine(response, "press-2");
  EXPECT_EQ(result.axis(), "press-2/feeder");
  EXPECT_EQ(result.command().id(), "press-2/4f-12");
  EXPECT_EQ(result.command().axis(), "press-2/feeder");
  EXPECT_EQ(result.command().client(), "anna");

  v1::AxisState state;
  state.set_axis("feeder");
  state.set_bus("line-a");
  state.add_inputs()->set_name("X0");
  put_machine(state, "press-2");
  EXPECT_EQ(state.bus(), "press-2/line-a");
  EXPECT_EQ(state.command_id(), "");
  EXPECT_EQ(state.inputs(0).name(), "X0");
}

}  // namespace
}  // namespace axisd::axisctl
