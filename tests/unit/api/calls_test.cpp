// Unary calls through a real connection.
#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>

#include <thread>

#include "api/server/reflection_service.hpp"
#include "axisd/v1/bus_service.grpc.pb.h"
#include "axisd/v1/command_service.grpc.pb.h"
#include "axisd/v1/system_service.grpc.pb.h"
#include "tests/unit/api/serving.hpp"

namespace axisd::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Stub = v1::AxisService::Stub;

class Calls : public Serving {
 protected:
  /// Calls one motion RPC; returns the status and keeps the command.
  template <class Request, class Response>
  grpc::Status call(
      grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
      const std::function<void(Request&)>& fill = [](Request&) {}) {
    Request request;
    request.set_axis("feeder");
    request.mutable_options()->set_request_id("r-1");
    fill(request);
    Response response;
    Call context;
    const auto status = (axes_.get()->*method)(&context, request, &response);
    command_ = response.command();
    return status;
  }
  /// Calls Home until it is with the machine, then leaves: what ends the call ends it there in the same way,
  /// be it a deadline, a cancellation or a lost connection.
  void call_and_leave() {
    Call context;
    grpc::Status status;
    std::thread caller([&] {
      v1::HomeRequest request;
      request.set_axis("feeder");
      request.mutable_options()->set_request_id("r-1");
      request.mutable_options()->set_wait_until(v1::WAIT_UNTIL_DONE);
      v1::HomeResponse response;
      status = axes_->Home(&context, request, &response);
    });
    EXPECT_TRUE(eventually([this] { return machine_.held() == 1; }));
    context.TryCancel();
    caller.join();
    EXPECT_EQ(status.error_code(), grpc::StatusCode::CANCELLED);
  }

  v1::Command command_;
};

TEST_F(Calls, EveryMotionReachesTheMachineAndReturnsItsCommand) {
  serve();
  EXPECT_TRUE(call(&Stub::Enable).ok());
  EXPECT_EQ(command_.kind(), v1::COMMAND_KIND_ENABLE);
  EXPECT_EQ(command_.id(), "c-1");
  EXPECT_EQ(command_.client(), own_name());
  EXPECT_TRUE(call(&Stub::Disable).ok());
  EXPECT_EQ(command_.kind(), v1::COMMAND_KIND_DISABLE);
  EXPECT_TRUE(call(&Stub::Home).ok());
  EXPECT_TRUE(call<v1::MoveAbsoluteRequest>(&Stub::MoveAbsolute, [](auto& r) { r.set_position(1); }).ok());
  EXPECT_TRUE(call<v1::MoveRelativeRequest>(&Stub::MoveRelative, [](auto& r) { r.set_distance(-2); }).ok());
  EXPECT_TRUE(call<v1::MoveVelocityRequest>(&Stub::MoveVelocity, [](auto& r) { r.set_velocity(3); }).ok());
  EXPECT_TRUE(call<v1::JogRequest>(&Stub::Jog, [](auto& r) { r.set_velocity(4); }).ok());
  EXPECT_TRUE(call(&Stub::Halt).ok());
  EXPECT_TRUE(call<v1::StopRequest>(&Stub::Stop, [](auto& r) { r.set_hold(true); }).ok());
  EXPECT_TRUE(call(&Stub::QuickStop).ok());
  EXPECT_TRUE(call(&Stub::Reset).ok());
  EXPECT_TRUE(call<v1::SetPositionRequest>(&Stub::SetPosition, [](auto& r) { r.set_position(5); }).ok());
  EXPECT_EQ(command_.kind(), v1::COMMAND_KIND_SET_POSITION);

  const auto seen = machine_.submitted();
  ASSERT_EQ(seen.size(), 12U);
  EXPECT_EQ(std::get<MoveAbsoluteRequest>(seen[3].action).position, 1);
  EXPECT_EQ(std::get<MoveRelativeRequest>(seen[4].action).distance, -2);
  EXPECT_EQ(std::get<MoveVelocityRequest>(seen[5].action).velocity, 3);
  EXPECT_EQ(std::get<JogRequest>(seen[6].action).velocity, 4);
  EXPECT_EQ(std::get<StopRequest>(seen[7].action).kind, StopKind::halt);
  EXPECT_EQ(std::get<StopRequest>(seen[8].action).kind, StopKind::stop);
  EXPECT_TRUE(std::get<StopRequest>(seen[8].action).hold);
  EXPECT_EQ(std::get<StopRequest>(seen[9].action).kind, StopKind::quick_stop);
  EXPECT_EQ(std::get<SetPositionRequest>(seen[11].action).position, 5);

  Call context;
  v1::ReleaseStopRequest release;
  release.set_axis("feeder");
  v1::ReleaseStopResponse released;
  EXPECT_TRUE(axes_->ReleaseStop(&context, release, &released).ok());
  EXPECT_THAT(machine_.log(), ElementsAre("release_stop feeder by " + own_name() + " as  whose 0 token 0"));
  EXPECT_EQ(released.command().id(), "c-1");
  ASSERT_EQ(released.holds_size(), 1);
  EXPECT_EQ(released.holds(0).request_id(), "r-1");
}

TEST_F(Calls, AMisspeltAxisIsAnsweredWithTheNearestName) {
  serve();
  const auto status = call<v1::HomeRequest>(&Stub::Home, [](auto& r) { r.set_axis("feedr"); });
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(detail_of(status).remedy(), "did you mean 'feeder'?");
  const auto capital = call<v1::StopRequest>(&Stub::Stop, [](auto& r) { r.set_axis("Feeder"); });
  EXPECT_EQ(detail_of(capital).remedy(), "did you mean 'feeder'?");
  EXPECT_TRUE(machine_.submitted().empty());
}

TEST_F(Calls, WaitUntilIsPassedOn) {
  serve();
  EXPECT_TRUE(call<v1::HomeRequest>(&Stub::Home, [](auto& r) {
                r.mutable_options()->set_wait_until(v1::WAIT_UNTIL_DONE);
              }).ok());
  EXPECT_TRUE(call<v1::HomeRequest>(&Stub::Home, [](auto& r) {
                r.mutable_options()->set_wait_until(v1::WAIT_UNTIL_STARTED);
              }).ok());
  EXPECT_EQ(machine_.submitted()[0].until, WaitUntil::done);
  EXPECT_EQ(machine_.submitted()[1].until, WaitUntil::started);
}

TEST_F(Calls, RefusalsCarryTypedDetails) {
  serve();
  machine_.refuse_with(Error{.reason = Reason::soft_limit,
                             .message = "target 500 is beyond the limit",
                             .remedy = "stay inside",
                             .permitted = Range{0, 400, "mm"}});
  auto status = call<v1::MoveAbsoluteRequest>(&Stub::MoveAbsolute, [](auto& r) { r.set_position(500); });
  EXPECT_EQ(status.error_code(), grpc::StatusCode::OUT_OF_RANGE);
  EXPECT_EQ(detail_of(status).reason(), v1::REASON_SOFT_LIMIT);
  EXPECT_EQ(detail_of(status).permitted().maximum(), 400);
  EXPECT_THAT(status.error_message(), HasSubstr("stay inside"));

  status = call(&Stub::MoveAbsolute);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(detail_of(status).message(), HasSubstr("position"));
  status = call<v1::HomeRequest>(&Stub::Home, [](auto& r) { r.mutable_options()->clear_request_id(); });
  EXPECT_EQ(detail_of(status).reason(), v1::REASON_INVALID_ARGUMENT);
  status = call<v1::StopRequest>(&Stub::Stop, [](auto& r) { r.set_axis("nobody"); });
  EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(detail_of(status).reason(), v1::REASON_UNKNOWN_AXIS);
  EXPECT_EQ(machine_.submitted().size(), 1U);
}

TEST_F(Calls, StopsNeedNoRequestId) {
  serve();
  for (const auto method : {&Stub::Stop})
    EXPECT_TRUE(call<v1::StopRequest>(method, [](auto& r) { r.clear_options(); }).ok());
  EXPECT_TRUE(call<v1::HaltRequest>(&Stub::Halt, [](auto& r) { r.clear_options(); }).ok());
  EXPECT_TRUE(call<v1::QuickStopRequest>(&Stub::QuickStop, [](auto& r) { r.clear_options(); }).ok());
  EXPECT_TRUE(call<v1::DisableRequest>(&Stub::Disable, [](auto& r) { r.clear_options(); }).ok());
}

TEST_F(Calls, ReadingNeverWaitsForTheCore) {
  serve();
  machine_.hold();
  Call context, list;
  v1::GetAxisRequest request;
  request.set_axis("turntable");
  v1::GetAxisResponse response;
  EXPECT_TRUE(axes_->GetAxis(&context, request, &response).ok());
  EXPECT_EQ(response.state().axis(), "turntable");
  v1::ListAxesResponse axes;
  EXPECT_TRUE(axes_->ListAxes(&list, {}, &axes).ok());
  EXPECT_EQ(axes.axes_size(), 2);
  Call unknown;
  request.set_axis("nobody");
  EXPECT_EQ(axes_->GetAxis(&unknown, request, &response).error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(Calls, CallThatEndsLeavesItsCommandAloneAndItsLateCallbackIsHarmless) {
  serve();
  machine_.hold();
  call_and_leave();
  machine_.let_go();
  EXPECT_TRUE(call(&Stub::Reset).ok());
  EXPECT_THAT(machine_.log(), ElementsAre());  // nothing was cancelled
}

TEST_F(Calls, CallbackAfterTheServersEndIsHarmless) {
  serve();
  machine_.hold();
  call_and_leave();
  server_.reset();
  machine_.let_go();
  machine_.publish({.name = "feeder"});  // the notification outlives the server, too
}

TEST_F(Calls, CallsInProgressAreBoundedPerClientButStopsAreNot) {
  serve({.limits = {.calls = 1, .streams = 64}});
  machine_.hold();
  std::thread first([this] {
    Call context;
    v1::HomeRequest request;
    request.set_axis("feeder");
    request.mutable_options()->set_request_id("r-1");
    v1::HomeResponse response;
    EXPECT_TRUE(axes_->Home(&context, request, &response).ok());
  });
  ASSERT_TRUE(eventually([this] { return machine_.held() == 1; }));
  const auto status = call(&Stub::Reset);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(detail_of(status).reason(), v1::REASON_BUSY);
  std::thread stop([this] {
    Call context;
    v1::StopRequest request;
    request.set_axis("feeder");
    v1::StopResponse response;
    EXPECT_TRUE(axes_->Stop(&context, request, &response).ok());
  });
  EXPECT_TRUE(eventually([this] { return machine_.held() == 2; }));
  machine_.let_go();
  first.join();
  stop.join();
  EXPECT_TRUE(call(&Stub::Reset).ok());
}

TEST_F(Calls, SystemAndBuses) {
  serve();
  const auto system = v1::SystemService::NewStub(channel_);
  Call c1, c2, c3, c4;
  v1::GetInfoResponse info;
  EXPECT_TRUE(system->GetInfo(&c1, {}, &info).ok());
  EXPECT_EQ(info.machine() + info.version() + info.instance_id() + info.inhibited_by(), "press-10.1i-1hmi");
  EXPECT_TRUE(info.inhibited());
  EXPECT_FALSE(info.has_storage_error());
  v1::StopAllRequest all;
  all.set_wait_until(v1::WAIT_UNTIL_DONE);
  v1::StopAllResponse stopped;
  EXPECT_TRUE(system->StopAll(&c2, all, &stopped).ok());
  ASSERT_EQ(stopped.results_size(), 2);
  EXPECT_EQ(stopped.results(0).command().kind(), v1::COMMAND_KIND_STOP);
  EXPECT_EQ(stopped.results(1).axis(), "turntable");
  EXPECT_EQ(stopped.results(1).error().reason(), v1::REASON_NOT_CONFIRMED);
  EXPECT_FALSE(stopped.has_not_durable());
  v1::ReleaseStopAllResponse released;
  EXPECT_TRUE(system->ReleaseStopAll(&c3, {}, &released).ok());
  EXPECT_THAT(machine_.log(),
              ElementsAre("stop_all " + own_name() + " done", "release_inhibit " + own_name()));
  v1::ListBusesResponse buses;
  EXPECT_TRUE(v1::BusService::NewStub(channel_)->ListBuses(&c4, {}, &buses).ok());
  ASSERT_EQ(buses.buses_size(), 2);
  EXPECT_EQ(buses.buses(0).timeouts(), 7U);
  EXPECT_EQ(buses.buses(0).kind(), v1::BUS_KIND_MODBUS_RTU);
  EXPECT_FALSE(buses.buses(0).has_network());
  EXPECT_EQ(buses.buses(1).kind(), v1::BUS_KIND_CANOPEN);
  EXPECT_EQ(buses.buses(1).port(), "can0");
  EXPECT_EQ(buses.buses(1).baud(), 500'000U);
  EXPECT_EQ(buses.buses(1).error().reason(), v1::REASON_BUS_DOWN);
  EXPECT_EQ(buses.buses(1).network().ShortDebugString(),
            "link: NETWORK_LINK_BUS_OFF frames_received: 11 frames_sent: 12 frames_not_sent: 13 "
            "frames_unknown: 14 error_frames: 15 receive_overflows: 16 no_buffer: 17 bus_offs: 18 stalls: 19 "
            "sdo_transfers: 21 sdo_aborts: 22 sdo_timeouts: 23 sdo_protocol_errors: 24 "
            "sync_period { nanos: 10000000 } sync_running: true sync_sent: 31 sync_missed: 32 "
            "sync_latest { nanos: 2000000 } emergencies: 3 foreign_nodes: 22 foreign_nodes: 23 "
            "foreign_frames: 42 unknown_frames: 41 malformed_frames: 43 "
            "link_helper_error { reason: REASON_BUS_DOWN message: \"no helper\" remedy: \"enable it\" "
            "outcome: OUTCOME_NOT_SENT bus: \"can0\" }");
}

TEST_F(Calls, StateIsToldAndAccepted) {
  machine_.state_report = {.seen = {.state = {.found = 12, .expected = 40}, .journal = {.found = 120}},
                           .convictions = {{.file = KeptFile::previous,
                                            .fault = KeptFault::foreign,
                                            .found = 12,
                                            .expected = 40,
                                            .detail = "more",
                                            .since = WallTime(std::chrono::seconds(7))}},
                           .start_count = 65'544};
  machine_.latch_trouble = Error{.reason = Reason::storage, .message = "full", .remedy = "free space"};
  machine_.storage_error = machine_.latch_trouble;
  serve();
  const auto system = v1::SystemService::NewStub(channel_);
  grpc::ClientContext c1, c2, c3, c4;
  v1::GetStateResponse state;
  EXPECT_TRUE(system->GetState(&c1, {}, &state).ok());
  const std::string conviction =
      "file: \"state.v1.previous\" fault: STATE_FAULT_FOREIGN found: 12 expected: 40 text: "
      "\"state.v1.previous "
      "does not belong to the other files: it has generation 12, but there was generation 40 (more)\" "
      "since { seconds: 7 }";
  EXPECT_EQ(state.ShortDebugString(),
            "files { name: \"state.v1\" generation: 12 expected: 40 } "
            "files { name: \"journal.v1\" generation: 120 } convictions { " +
                conviction + " } start_count: 65544");
  v1::AcceptStateResponse accepted;
  EXPECT_TRUE(system->AcceptState(&c2, {}, &accepted).ok());
  EXPECT_EQ(accepted.ShortDebugString(), "accepted { " + conviction + " }");
  v1::GetInfoResponse info;
  EXPECT_TRUE(system->GetInfo(&c3, {}, &info).ok());
  EXPECT_EQ(info.state_unaccepted(), state.convictions(0).text());
  EXPECT_EQ(info.storage_error().message(), "full");
  v1::StopAllResponse stopped;
  EXPECT_TRUE(system->StopAll(&c4, {}, &stopped).ok());
  EXPECT_EQ(stopped.not_durable().reason(), v1::REASON_STORAGE);
  EXPECT_EQ(stopped.not_durable().message(), "full");
  EXPECT_THAT(machine_.log(), ElementsAre("kept_state", "accept_state " + own_name(),
                                          "stop_all " + own_name() + " accepted"));
}

TEST_F(Calls, BudgetsOfAllBusesOrOfOne) {
  serve();
  const auto buses = v1::BusService::NewStub(channel_);
  Call c1, c2, c3;
  v1::GetBudgetRequest request;
  v1::GetBudgetResponse all, one;
  EXPECT_TRUE(buses->GetBudget(&c1, request, &all).ok());
  ASSERT_EQ(all.budgets_size(), 1);
  EXPECT_EQ(all.budgets(0).ShortDebugString(),
            "bus: \"line-a\" load { utilisation: 0.25 utilisation_max: 0.5 refresh_idle { nanos: 300000000 } "
            "start { nanos: 80000000 } } "
            "stops { axes: 1 last_frame { nanos: 28000000 } standstill { nanos: 120000000 } } "
            "axes { axis: \"feeder\" stop_alone { } stop_all { } deceleration_time { nanos: 150000000 } "
            "way_alone: 10.5 unit: \"mm\" observed { stop_frame { nanos: 7000000 } } } "
            "excess { key: \"stop_bound\" message: \"too late\" remedy: \"raise it\" } notes: \"a note\"");
  request.set_bus("line-a");
  EXPECT_TRUE(buses->GetBudget(&c2, request, &one).ok());
  EXPECT_EQ(one.budgets_size(), 1);
  request.set_bus("line-z");
  EXPECT_EQ(buses->GetBudget(&c3, request, &one).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(Calls, CommandsAsResources) {
  serve();
  const auto commands = v1::CommandService::NewStub(channel_);
  Call c1, c2, c3, c4;
  v1::GetCommandRequest get;
  v1::GetCommandResponse got;
  EXPECT_EQ(commands->GetCommand(&c1, get, &got).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  get.set_id("c-1");
  EXPECT_TRUE(commands->GetCommand(&c2, get, &got).ok());
  EXPECT_EQ(got.command().id(), "c-1");
  v1::CancelCommandRequest cancel;
  cancel.set_id("c-1");
  v1::CancelCommandResponse cancelled;
  EXPECT_TRUE(commands->CancelCommand(&c3, cancel, &cancelled).ok());
  EXPECT_THAT(machine_.log(), ElementsAre("get_command c-1", "cancel_command c-1 by " + own_name()));
  machine_.refuse_with(Error{.reason = Reason::unknown_command});
  const auto status = commands->GetCommand(&c4, get, &got);
  EXPECT_EQ(detail_of(status).reason(), v1::REASON_UNKNOWN_COMMAND);
}

struct GenericReply {
  grpc::Status status;
  std::string text;
};

/// Calls by path, for services whose proto files are not part of the contract.
GenericReply generic_call(const std::shared_ptr<grpc::Channel>& channel, const std::string& path,
                          const std::string& request) {
  grpc::GenericStub stub(channel);
  grpc::CompletionQueue queue;
  Call context;
  const auto call = stub.PrepareCall(&context, path, &queue);
  const auto step = [&] {
    void* tag = nullptr;
    bool ok = false;  // not of a call that was refused: its status says so
    EXPECT_TRUE(queue.Next(&tag, &ok));
  };
  const grpc::Slice slice(request);
  grpc::ByteBuffer out(&slice, 1), in;
  call->StartCall(nullptr);
  step();
  call->Write(out, nullptr);
  step();
  call->Read(&in, nullptr);
  step();
  call->WritesDone(nullptr);
  step();
  GenericReply reply;
  call->Finish(&reply.status, nullptr);
  step();
  std::vector<grpc::Slice> slices;
  if (in.Valid() && in.Dump(&slices).ok())
    for (const auto& part : slices)
      reply.text.append(reinterpret_cast<const char*>(part.begin()), part.size());
  return reply;
}

const std::string reflection_path = "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo";
const std::string list_services("\x3a\x00", 2);  // list_services: ""

TEST_F(Calls, HealthAndReflectionAreServed) {
  serve({.reflection = true});
  EXPECT_EQ(generic_call(channel_, "/grpc.health.v1.Health/Check", "").text, "\x08\x01");  // SERVING
  EXPECT_EQ(generic_call(channel_, "/grpc.health.v1.Health/Check",
                         "\x0a\x14"
                         "axisd.v1.AxisService")
                .text,
            "\x08\x01");
  const auto services = generic_call(channel_, reflection_path, list_services).text;
  for (const auto& name : server_->services()) EXPECT_THAT(services, HasSubstr(name));
}

/// What a tool asks for until it knows the contract.
TEST_F(Calls, ReflectionTellsOfTheWholeContract) {
  serve({.reflection = true});
  const auto ask = [&](char field, std::string_view text, const std::string& path) {
    return generic_call(channel_, path, std::string{field, static_cast<char>(text.size())}.append(text)).text;
  };
  for (const auto* path : server::ReflectionService::paths) {
    const auto file = ask('\x22', "axisd.v1.AxisService", path);  // file_containing_symbol
    EXPECT_THAT(file, HasSubstr("axisd/v1/axis_service.proto"));
    EXPECT_THAT(file, HasSubstr("MoveAbsoluteRequest"));
    EXPECT_THAT(ask('\x1a', "axisd/v1/error.proto", path), HasSubstr("ErrorDetail"));  // file_by_filename
    EXPECT_THAT(ask('\x1a', "nowhere.proto", path), HasSubstr("there is no such file"));
    EXPECT_THAT(ask('\x22', "axisd.v1.Nobody", path), HasSubstr("there is no such file"));
    EXPECT_THAT(ask('\x32', "axisd.v1.Axis", path), HasSubstr("not told"));  // all_extension_numbers_of_type
    EXPECT_THAT(generic_call(channel_, path, "").text, HasSubstr("not told"));
    EXPECT_THAT(generic_call(channel_, path, list_services).text, HasSubstr("grpc.health.v1.Health"));
  }
}

/// Also in a process that has served it already.
TEST_F(Calls, ReflectionIsOffUnlessAskedFor) {
  for (const bool served : {false, true, false}) {
    serve({.reflection = served});
    const auto reply = generic_call(channel_, reflection_path, list_services);
    EXPECT_EQ(reply.status.error_code(), served ? grpc::StatusCode::OK : grpc::StatusCode::UNIMPLEMENTED);
    EXPECT_EQ(reply.text.empty(), !served);
    EXPECT_EQ(generic_call(channel_, "/grpc.health.v1.Health/Check", "").text, "\x08\x01") << served;
  }
}

TEST_F(Calls, OversizedRequestsAreRefusedAndTheConnectionLives) {
  serve();
  Call context;
  v1::GetAxisRequest request;
  request.set_axis(std::string(std::size_t{300} * 1024, 'a'));
  v1::GetAxisResponse response;
  EXPECT_EQ(axes_->GetAxis(&context, request, &response).error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(call(&Stub::Stop).ok());
}

}  // namespace
}  // namespace axisd::testing
