// What gRPC tells of a caller.
#pragma once

#include <grpcpp/server_context.h>

#include <optional>
#include <string>

#include "buses/clock.hpp"

namespace axisd::server {

/// How long the caller waits for the answer, from this call on, by the clock of its deadline; nothing: for
/// ever. Not above a day.
[[nodiscard]] std::optional<Duration> patience_of(const grpc::CallbackServerContext& context);

/// "ipv4:127.0.0.1:50312" to "127.0.0.1", "ipv6:%5B::1%5D:50312" to "::1", "unix:..." to "unix".
[[nodiscard]] std::string peer_host(const std::string& peer);

}  // namespace axisd::server
