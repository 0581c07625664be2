// gRPC's reflection (grpc.reflection), bounded: that of gRPC's library takes a thread for each stream, and
// keeps what waits for one without a bound.
#pragma once

#include <google/protobuf/empty.pb.h>
#include <grpcpp/impl/service_type.h>
#include <grpcpp/support/server_callback.h>

#include <string>
#include <utility>
#include <vector>

#include "api/server/services.hpp"

namespace axisd::server {

/// On the wire; the contract of reflection itself is not compiled here, and its few fields are read and
/// written by their numbers.
using ReflectionMessage = google::protobuf::Empty;

/// What one question is answered with: names of `services`, the file of a name or a symbol, or an error.
/// Pure.
[[nodiscard]] ReflectionMessage reflect(const ReflectionMessage& question,
                                        const std::vector<std::string>& services);

/// Tells tools of the contract, whoever asks: no role is needed. One question of a stream at a time. Thread:
/// gRPC.
class ReflectionService final : public grpc::Service {
 public:
  /// Tools ask for one or the other.
  static constexpr const char* paths[] = {"/grpc.reflection.v1.ServerReflection/ServerReflectionInfo",
                                          "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo"};

  explicit ReflectionService(const Services& services);
  /// Full names of the services that it tells of. Before the first call.
  void serve(std::vector<std::string> services) { told_ = std::move(services); }

 private:
  const Services services_;
  std::vector<std::string> told_;
};

}  // namespace axisd::server
