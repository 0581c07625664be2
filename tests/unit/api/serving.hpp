// A fake machine behind a real server on a unix socket, and clients for it.
#pragma once

#include <google/protobuf/descriptor.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "api/server/local_peer.hpp"
#include "api/server/server.hpp"
#include "api/transport/listen.hpp"
#include "axisd/v1/axis_service.grpc.pb.h"
#include "axisd/v1/error.pb.h"
#include "tests/unit/api/fake_machine.hpp"

namespace axisd::testing {

/// Long enough for a loaded machine; no test waits for it to pass.
inline constexpr auto patience = std::chrono::seconds(30);

/// A directory of its own, removed at the end.
class TemporaryDirectory {
 public:
  TemporaryDirectory() {
    std::string pattern = (std::filesystem::temp_directory_path() / "axisd-api-XXXXXX").string();
    path_ = mkdtemp(pattern.data());
  }
  ~TemporaryDirectory() { std::filesystem::remove_all(path_); }
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;
  [[nodiscard]] std::string operator/(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

/// Who a client in this process is, on a unix socket.
inline const std::string& own_name() {
  static const auto name = server::local_peer(transport::connected_pair().first.get()).name;
  return name;
}

/// Looks again until `condition` holds; false if it never does.
inline bool eventually(const std::function<bool()>& condition) {
  const auto end = monotonic_now() + patience;
  while (!condition()) {
    if (monotonic_now() > end) return false;
    block_until(monotonic_now() + std::chrono::milliseconds(5));
  }
  return true;
}

/// A connection of its own, not shared with other channels of the process.
inline std::shared_ptr<grpc::Channel> connect(
    const std::string& target,
    const std::shared_ptr<grpc::ChannelCredentials>& credentials = grpc::InsecureChannelCredentials(),
    grpc::ChannelArguments arguments = {}) {
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return grpc::CreateCustomChannel(target, credentials, arguments);
}

/// One call's context, with a deadline.
struct Call : grpc::ClientContext {
  explicit Call(std::chrono::milliseconds timeout = patience) {
    set_deadline(std::chrono::system_clock::now() + timeout);
  }
};

/// All calls of a service of ours, by its full name.
inline std::vector<const google::protobuf::MethodDescriptor*> calls_of(const std::string& service) {
  std::vector<const google::protobuf::MethodDescriptor*> all;
  const auto* found = google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(service);
  EXPECT_NE(found, nullptr) << service;
  for (int i = 0; found != nullptr && i < found->method_count(); ++i) all.push_back(found->method(i));
  return all;
}

/// All calls of the main address.
inline std::vector<const google::protobuf::MethodDescriptor*> served_calls() {
  FakeMachine machine;
  std::vector<const google::protobuf::MethodDescriptor*> all;
  for (const auto& service : server::Server(machine, {}).services())
    std::ranges::copy(calls_of(service), std::back_inserter(all));
  return all;
}

/// The typed detail of a failed call.
inline v1::ErrorDetail detail_of(const grpc::Status& status) {
  v1::StatusDetails details;
  v1::ErrorDetail detail;
  EXPECT_TRUE(details.ParseFromString(status.error_details()));
  EXPECT_EQ(details.details_size(), 1);
  if (details.details_size() == 1) {
    EXPECT_TRUE(detail.ParseFromString(details.details(0).value()));
  }
  return detail;
}

class Serving : public ::testing::Test {
 protected:
  /// Serves with these options on a unix socket.
  void serve(server::ServerOptions options = {}) {
    target_ = "unix:" + (directory_ / "axisd.sock");
    options.listen = {target_};
    server_ = std::make_unique<server::Server>(machine_, std::move(options));
    const auto started = server_->start();
    ASSERT_TRUE(started) << to_string(started.error());
    channel_ = connect(target_);
    axes_ = v1::AxisService::NewStub(channel_);
  }

  TemporaryDirectory directory_;
  FakeMachine machine_;
  std::string target_;
  std::unique_ptr<server::Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::AxisService::Stub> axes_;
};

}  // namespace axisd::testing
