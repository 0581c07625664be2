// Who is at the other end of a call.
#pragma once

#include <grpcpp/server_context.h>

#include <string>

namespace axisd::transport {

/// The certificate of the caller, and behind it those that it came with, as PEM; empty: it has shown none.
/// Thread: that of the call.
[[nodiscard]] std::string certificates_of(const grpc::ServerContextBase& context);

}  // namespace axisd::transport
