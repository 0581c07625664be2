// The entrance's own errors, as axisd has them.
#pragma once

#include <grpcpp/support/status.h>

#include <string>

#include "axisd/v1/error.pb.h"
#include "buses/error.hpp"

namespace axisd::cell {

[[nodiscard]] axisd::v1::ErrorDetail detail_of(axisd::v1::Reason reason, std::string message,
                                               std::string remedy);
/// With the detail in the grpc-status-details-bin trailer (google.rpc.Status wire format).
[[nodiscard]] grpc::Status to_status(grpc::StatusCode code, const axisd::v1::ErrorDetail& detail);
[[nodiscard]] grpc::Status to_status(grpc::StatusCode code, axisd::v1::Reason reason, std::string message,
                                     std::string remedy);
/// What somebody else answered; its own words where it has no detail.
[[nodiscard]] axisd::v1::ErrorDetail detail_of(const grpc::Status& status);
/// With its address: the machine's name stands before that of the axis.
[[nodiscard]] axisd::v1::ErrorDetail named(axisd::v1::ErrorDetail detail, const std::string& machine);
/// REASON_STORAGE.
[[nodiscard]] axisd::v1::ErrorDetail detail_of(const Error& error);

}  // namespace axisd::cell
