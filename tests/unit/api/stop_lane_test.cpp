// The stop lane through real connections.
#include "api/server/lane/stop_lane.hpp"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <grpcpp/create_channel_posix.h>
#include <grpcpp/generic/generic_stub.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <fstream>
#include <iterator>
#include <regex>
#include <thread>

#include "api/server/lane/stop_calls.hpp"
#include "axisd/v1/stop_service.grpc.pb.h"
#include "buses/file_descriptor.hpp"
#include "tests/support/source_tree.hpp"
#include "tests/support/stream_socket.hpp"
#include "tests/unit/api/certificates.hpp"
#include "tests/unit/api/serving.hpp"

namespace axisd::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

class Lane : public ::testing::Test {
 protected:
  void serve(server::StopLaneOptions options = {}) {
    if (options.listen.empty()) options.listen = "127.0.0.1:0";
    lane_ = std::make_unique<server::StopLane>(machine_, std::move(options));
    const auto port = lane_->listen();
    ASSERT_TRUE(port) << to_string(port.error());
    lane_->serve();
    port_ = *port;
    target_ = "127.0.0.1:" + std::to_string(port_);
  }
  std::unique_ptr<v1::StopService::Stub> client(
      const std::shared_ptr<grpc::ChannelCredentials>& credentials = grpc::InsecureChannelCredentials()) {
    return v1::StopService::NewStub(connect(target_, credentials));
  }
  static std::pair<grpc::Status, v1::StopResponse> stop(v1::StopService::Stub& client,
                                                        const std::string& axis = "feeder") {
    Call context;
    v1::StopRequest request;
    request.set_axis(axis);
    v1::StopResponse response;
    return {client.Stop(&context, request, &response), response};
  }
  /// A connection that says nothing.
  FileDescriptor silent() const {
    auto fd = test::stream_socket();
    sockaddr_in address{.sin_family = AF_INET, .sin_port = htons(static_cast<std::uint16_t>(port_))};
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(fd.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    return fd;
  }

  TemporaryDirectory directory_;
  FakeMachine machine_;
  std::unique_ptr<server::StopLane> lane_;
  int port_ = 0;
  std::string target_;
};

TEST_F(Lane, EveryCallReachesTheMachine) {
  serve();
  auto stub = client();
  const auto call = [&]<class Request, class Response>(grpc::Status (v1::StopService::Stub::*method)(
                                                           grpc::ClientContext*, const Request&, Response*),
                                                       const Request& asked) {
    Call context;
    auto request = asked;
    if constexpr (requires { request.set_axis("feeder"); }) request.set_axis("feeder");
    Response response;
    const auto status = (stub.get()->*method)(&context, request, &response);
    EXPECT_TRUE(status.ok()) << Request::descriptor()->name() << ": " << status.error_message();
    return response;
  };
  using Stub = v1::StopService::Stub;
  EXPECT_EQ(call(&Stub::Halt, v1::HaltRequest()).command().kind(), v1::COMMAND_KIND_HALT);
  const auto stopped = call(&Stub::Stop, v1::StopRequest()).command();
  EXPECT_EQ(stopped.kind(), v1::COMMAND_KIND_STOP);
  EXPECT_EQ(stopped.client(), "local:localhost");
  call(&Stub::QuickStop, v1::QuickStopRequest());
  call(&Stub::Disable, v1::DisableRequest());
  v1::JogRequest jog;
  jog.set_velocity(4);
  jog.mutable_options()->set_request_id("r-1");
  EXPECT_EQ(call(&Stub::Jog, jog).command().kind(), v1::COMMAND_KIND_JOG);
  v1::GroupStopRequest group;
  group.add_axes("feeder");
  call(&Stub::GroupStop, group);
  v1::GroupHaltRequest halt;
  halt.add_axes("feeder");
  call(&Stub::GroupHalt, halt);
  call(&Stub::StopAll, v1::StopAllRequest());
  call(&Stub::RenewLease, v1::RenewLeaseRequest());
  v1::RenewPreparedRequest renew;
  renew.set_id("g-1");
  EXPECT_EQ(call(&Stub::RenewPrepared, renew).move().id(), "g-1");
  v1::CancelCommandRequest cancel;
  cancel.set_id("c-1");
  call(&Stub::CancelCommand, cancel);
  EXPECT_EQ(machine_.submitted().size(), 5U);
  // All that the contract has, and nothing else.
  std::ifstream contract(test::in_source_tree("proto/axisd/v1/stop_service.proto"));
  const std::string text{std::istreambuf_iterator<char>(contract), {}};
  const std::regex rpc("rpc (\\w+)\\(");
  std::vector<std::string> published;
  for (auto each = std::sregex_iterator(text.begin(), text.end(), rpc); each != std::sregex_iterator();
       ++each)
    published.push_back("/axisd.v1.StopService/" + (*each)[1].str());
  const auto taken = server::lane::StopCalls::paths();
  EXPECT_THAT(published, ::testing::UnorderedElementsAreArray(taken.begin(), taken.end()));
}

TEST_F(Lane, ErrorsCarryTheirDetail) {
  serve();
  auto stub = client();
  const auto [unknown, none] = stop(*stub, "no-such-axis");
  EXPECT_EQ(unknown.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(detail_of(unknown).reason(), v1::REASON_UNKNOWN_AXIS);
  machine_.refuse_with(
      Error{.reason = Reason::offline, .message = "100 % gone: gr\xC3\xBC\xC3\x9F", .remedy = "look"});
  const auto [offline, nothing] = stop(*stub);
  EXPECT_EQ(offline.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_THAT(offline.error_message(), HasSubstr("100 % gone: gr\xC3\xBC\xC3\x9F"));
  EXPECT_EQ(detail_of(offline).remedy(), "look");
}

/// Whoever asks for axes that there are not makes nobody wait.
TEST_F(Lane, WhatWasMeantIsLookedForNowAndThen) {
  serve();
  auto stub = client();
  const auto suggested = [&] {
    const auto [status, response] = stop(*stub, "feedr");
    EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
    EXPECT_EQ(detail_of(status).reason(), v1::REASON_UNKNOWN_AXIS);
    EXPECT_EQ(detail_of(status).message(), "there is no axis 'feedr'");
    return detail_of(status).remedy() == "did you mean 'feeder'?";
  };
  int count = 0;
  while (count < 100 && suggested()) ++count;
  EXPECT_EQ(count, static_cast<int>(server::lane::StopCalls::suggestions));
  EXPECT_TRUE(stop(*stub).first.ok()) << "of a stop of an axis that there is nothing is counted";
  machine_.set_now(machine_.now() + 1s);
  EXPECT_TRUE(suggested());
}

TEST_F(Lane, WhatIsNoStopIsRefused) {
  serve();
  auto axes = v1::AxisService::NewStub(connect(target_));
  Call context;
  v1::StopRequest request;
  request.set_axis("feeder");
  v1::StopResponse response;
  EXPECT_EQ(axes->Stop(&context, request, &response).error_code(), grpc::StatusCode::UNIMPLEMENTED);
  EXPECT_TRUE(machine_.submitted().empty());
}

TEST_F(Lane, ALateAnswerFindsNobodyAndHarmsNothing) {
  serve();
  machine_.hold();
  auto stub = client();
  {
    Call context(100ms);
    v1::StopRequest request;
    request.set_axis("feeder");
    v1::StopResponse response;
    EXPECT_EQ(stub->Stop(&context, request, &response).error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  }
  stub.reset();
  EXPECT_TRUE(eventually([&] { return machine_.held() == 1; }));
  machine_.let_go();
  auto next = client();
  EXPECT_TRUE(stop(*next).first.ok());
  machine_.hold();
  std::thread caller([&] { EXPECT_FALSE(stop(*next).first.ok()); });
  EXPECT_TRUE(eventually([&] { return machine_.held() == 1; }));
  lane_->stop();
  caller.join();
  machine_.let_go();
}

/// None of its stops is dropped, and nobody else waits for them.
TEST_F(Lane, WhoeverHasTooManyStopsWaitingIsReadFromLater) {
  serve();
  auto stub = client();
  EXPECT_TRUE(stop(*stub).first.ok());
  machine_.let_stops_wait("local:localhost", server::StopLane::most_unserved + 1);
  {
    Call context(200ms);
    v1::StopRequest request;
    request.set_axis("feeder");
    v1::StopResponse response;
    EXPECT_EQ(stub->Stop(&context, request, &response).error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  }
  EXPECT_EQ(machine_.submitted().size(), 1U);
  auto other =
      v1::StopService::NewStub(grpc::CreateInsecureChannelFromFd("axisd", lane_->connect_inside().release()));
  EXPECT_TRUE(stop(*other).first.ok());
  EXPECT_EQ(machine_.submitted().size(), 2U);
  machine_.let_stops_wait("local:localhost", server::StopLane::most_unserved);
  EXPECT_TRUE(eventually([&] { return machine_.submitted().size() == 3; })) << "though nobody waits for it";
  EXPECT_TRUE(stop(*stub).first.ok());
}

TEST_F(Lane, SilentConnectionsKeepNobodyOut) {
  serve();
  std::vector<FileDescriptor> crowd;
  crowd.reserve(400);
  for (int i = 0; i < 400; ++i) crowd.push_back(silent());
  auto stub = client();
  EXPECT_TRUE(stop(*stub).first.ok());
}

/// As a client of a busy computer: others connect between its connection and its first word.
TEST_F(Lane, WhoeverIsSlowToSpeakKeepsItsPlaceInACrowd) {
  serve();
  auto ours = silent();
  std::vector<FileDescriptor> crowd;
  crowd.reserve(400);
  for (int i = 0; i < 400; ++i) crowd.push_back(silent());
  auto fence = client();
  ASSERT_TRUE(stop(*fence).first.ok()) << "all of them have been let in";
  auto slow = v1::StopService::NewStub(grpc::CreateInsecureChannelFromFd("axisd", ours.release()));
  const auto [status, response] = stop(*slow);
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(response.command().client(), "local:localhost");
}

TEST_F(Lane, WhoeverSaysNothingHasItsTime) {
  serve({.silent = {.patience = 50ms}});
  const auto mute = silent();
  char byte = 0;
  EXPECT_EQ(recv(mute.get(), &byte, 1, 0), 0) << "it is closed";
  auto stub = client();
  EXPECT_TRUE(stop(*stub).first.ok());
}

TEST_F(Lane, OfACrowdBeyondItsRoomTheOldestGo) {
  serve({.silent = {.most = 4}});
  const auto oldest = silent();
  std::vector<FileDescriptor> crowd;
  crowd.reserve(4);
  for (int i = 0; i < 4; ++i) crowd.push_back(silent());
  char byte = 0;
  EXPECT_EQ(recv(oldest.get(), &byte, 1, 0), 0) << "it is closed";
  EXPECT_EQ(recv(crowd.back().get(), &byte, 1, MSG_DONTWAIT), -1) << "it is open";
}

TEST_F(Lane, ClientsThatAreKilledWhileTheyWaitHarmNobody) {
  serve();
  for (int i = 0; i < 20; ++i) {
    machine_.hold();
    std::thread caller([&] {
      auto stub = client();
      Call context(50ms);
      v1::StopRequest request;
      request.set_axis("feeder");
      v1::StopResponse response;
      (void)stub->Stop(&context, request, &response);
    });
    EXPECT_TRUE(eventually([&] { return machine_.held() == 1; }));
    if (i % 2 == 0) caller.join();
    machine_.let_go();  // now and then the answer meets the end of the connection
    if (i % 2 != 0) caller.join();
  }
  auto next = client();
  EXPECT_TRUE(stop(*next).first.ok());
}

TEST_F(Lane, ManyCallsOfManyClients) {
  serve();
  std::vector<std::thread> callers;
  std::atomic<int> good{0};
  callers.reserve(8);
  for (int i = 0; i < 8; ++i)
    callers.emplace_back([&] {
      auto stub = client();
      for (int n = 0; n < 25; ++n) good += stop(*stub).first.ok() ? 1 : 0;
    });
  for (auto& caller : callers) caller.join();
  EXPECT_EQ(good, 200);
}

TEST_F(Lane, OnlyVerifiedClientsAreServedByTheirName) {
  Certificates certificates(directory_);
  Certificates::set_clock(machine_);
  certificates.make_ca("ca");
  certificates.make_ca("stranger-ca");
  certificates.make_pair("server", "ca");
  certificates.make_pair("hmi-1", "ca");
  certificates.make_pair("intruder", "stranger-ca");
  serve({.listen = "127.0.0.1:0", .tls = certificates.served()});
  auto hmi = client(certificates.client("hmi-1"));
  const auto [status, response] = stop(*hmi);
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(response.command().client(), "hmi-1");
  for (const auto& wrong :
       {certificates.client("intruder"), certificates.client(""), grpc::InsecureChannelCredentials()}) {
    auto stub = client(wrong);
    EXPECT_FALSE(stop(*stub).first.ok());
  }
  std::vector<FileDescriptor> crowd;
  crowd.reserve(200);
  for (int i = 0; i < 200; ++i) crowd.push_back(silent());
  auto late = client(certificates.client("hmi-1"));
  EXPECT_TRUE(stop(*late).first.ok());
  EXPECT_EQ(machine_.submitted().size(), 2U);
}

/// Holds, leases and request ids are by identity.
TEST_F(Lane, AClientIsTheSameAtBothAddresses) {
  Certificates certificates(directory_);
  Certificates::set_clock(machine_);
  certificates.make_ca("ca");
  certificates.make_pair("server", "ca");
  certificates.make_pair("named", "ca");
  certificates.make_pair("dns", "ca", "/O=x", "subjectAltName=DNS:panel.local\n");
  certificates.make_pair("uri", "ca", "/O=x", "subjectAltName=URI:spiffe://cell/hmi,DNS:other\n");
  certificates.make_pair("ip", "ca", "/O=x", "subjectAltName=IP:10.1.2.3\n");
  certificates.make_pair("nameless", "ca", "/O=x", "");
  serve({.listen = "127.0.0.1:0", .tls = certificates.served()});
  server::Server main(machine_, {.listen = {"127.0.0.1:0"}, .tls = certificates.served()});
  const auto port = main.start();
  ASSERT_TRUE(port) << to_string(port.error());
  for (const auto* name : {"named", "dns", "uri", "ip", "nameless"}) {
    auto here = client(certificates.client(name));
    const auto [status, response] = stop(*here);
    ASSERT_TRUE(status.ok()) << name << ": " << status.error_message();
    auto there =
        v1::AxisService::NewStub(connect("127.0.0.1:" + std::to_string(*port), certificates.client(name)));
    Call context;
    v1::StopRequest request;
    request.set_axis("feeder");
    v1::StopResponse same;
    ASSERT_TRUE(there->Stop(&context, request, &same).ok()) << name;
    EXPECT_EQ(response.command().client(), same.command().client()) << name;
    EXPECT_FALSE(same.command().client().empty()) << name;
  }
  main.shutdown();
}

TEST_F(Lane, ARevokedClientHasNoStopHereEither) {
  Certificates certificates(directory_);
  Certificates::set_clock(machine_);
  certificates.make_ca("ca");
  certificates.make_pair("server", "ca");
  certificates.make_pair("hmi-1", "ca");
  certificates.make_pair("hmi-2", "ca");
  certificates.revoke("ca", {});
  auto files = certificates.server_files();
  files.crl = directory_ / "ca.crl";
  const auto live = Certificates::served(files);
  serve({.listen = "127.0.0.1:0", .tls = live});
  auto old = client(certificates.client("hmi-1"));
  ASSERT_TRUE(stop(*old).first.ok());
  certificates.revoke("ca", {"hmi-1"});
  ASSERT_TRUE(live->reload().value_or(false));
  const auto again = client(certificates.client("hmi-1"));
  for (auto* stub : {old.get(), again.get()}) {
    const auto status = stop(*stub).first;
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED);
    EXPECT_NE(status.error_message().find("was revoked"), std::string::npos) << status.error_message();
  }
  auto other = client(certificates.client("hmi-2"));
  EXPECT_TRUE(stop(*other).first.ok());
  EXPECT_EQ(machine_.submitted().size(), 2U);
}

TEST_F(Lane, NewConnectionsGetNewFiles) {
  Certificates certificates(directory_);
  Certificates::set_clock(machine_);
  certificates.make_ca("ca");
  certificates.make_pair("server", "ca");
  certificates.make_pair("hmi-1", "ca");
  const auto live = certificates.served();
  serve({.listen = "127.0.0.1:0", .tls = live});
  certificates.make_ca("ca");
  certificates.make_pair("server", "ca");
  certificates.make_pair("hmi-1", "ca");
  auto early = client(certificates.client("hmi-1"));
  EXPECT_FALSE(stop(*early).first.ok()) << "the daemon still shows the old one";
  ASSERT_TRUE(live->reload().value_or(false));
  auto late = client(certificates.client("hmi-1"));
  EXPECT_TRUE(stop(*late).first.ok());
}

TEST(StopLaneAddress, IsNextToThatOfTheServer) {
  EXPECT_EQ(server::stop_lane_of("localhost:7443"), "localhost:7444");
  EXPECT_EQ(server::stop_lane_of("[::1]:7443"), "[::1]:7444");
  EXPECT_EQ(server::stop_lane_of("127.0.0.1:0"), "127.0.0.1:0");
  EXPECT_EQ(server::stop_lane_of("unix:/run/axisd/axisd.sock"), "unix:/run/axisd/axisd.sock.stop");
}

}  // namespace
}  // namespace axisd::testing
