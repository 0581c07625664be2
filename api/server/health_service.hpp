// gRPC's health service (grpc.health.v1), bounded: that of gRPC's library takes any number of watches.
#pragma once

#include <google/protobuf/wrappers.pb.h>
#include <grpcpp/impl/service_type.h>
#include <grpcpp/support/server_callback.h>

#include <atomic>
#include <string>
#include <utility>
#include <vector>

#include "api/server/services.hpp"

namespace axisd::server {

/// Says that the daemon serves, to whoever asks: no role is needed. A watch ends with the server, or when its
/// client has to go. Thread: gRPC.
class HealthService final : public grpc::Service {
 public:
  static constexpr const char* name = "grpc.health.v1.Health";

  explicit HealthService(const Services& services);
  /// Full names of the services that can be asked for beside "", which stands for the daemon. Before the
  /// first call.
  void serve(std::vector<std::string> names) { names_ = std::move(names); }
  /// From now on it says that the daemon does not serve. Thread: any.
  void end() { ending_ = true; }

 private:
  using Context = grpc::CallbackServerContext;
  /// On the wire a HealthCheckRequest is a string, and a HealthCheckResponse is a number.
  using Request = google::protobuf::StringValue;
  using Response = google::protobuf::Int32Value;

  grpc::ServerUnaryReactor* check(Context* context, const Request& request, Response& response);
  grpc::ServerWriteReactor<Response>* watch(Context* context, const Request& request);
  [[nodiscard]] bool knows(const std::string& service) const;

  const Services services_;
  std::vector<std::string> names_;
  std::atomic<bool> ending_{false};
};

}  // namespace axisd::server
