#pragma once

#include <grpcpp/server_context.h>

#include <optional>

#include "buses/clock.hpp"

namespace axisd::transport {

/// How long the caller waits for the answer, from this call on, by the clock of its deadline; nothing: for
/// ever. Not above a day.
[[nodiscard]] std::optional<Duration> patience_of(const grpc::CallbackServerContext& context);

}  // namespace axisd::transport
