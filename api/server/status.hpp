// The one mapping from axisd's errors to gRPC statuses with typed details.
#pragma once

#include <grpcpp/support/status.h>

#include "buses/error.hpp"

namespace axisd::server {

/// The status code of a call that failed for this reason; proto/axisd/v1/error.proto documents it for
/// clients.
[[nodiscard]] grpc::StatusCode status_code(Reason reason);

/// Status with the error as ErrorDetail in the grpc-status-details-bin trailer (google.rpc.Status wire
/// format).
[[nodiscard]] grpc::Status to_status(const Error& error);

/// UNAVAILABLE, for calls that the daemon's shutdown cuts off. What was accepted is not changed by it.
[[nodiscard]] grpc::Status shutting_down();

}  // namespace axisd::server
