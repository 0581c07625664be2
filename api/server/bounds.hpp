// How much a request may carry, as the contract says it (proto/axisd/v1/bounds.proto).
#pragma once

#include <google/protobuf/message.h>

#include "buses/error.hpp"

namespace axisd::server {

/// Looks at every repeated field, string and bytes of a request before anything is made of it. The bounds of
/// all requests are read from their descriptors once, at the first call; a check then looks at sizes alone.
/// Errors: invalid_argument, naming the field, how much was sent and how much is permitted. Thread: any.
[[nodiscard]] Result<void> check_bounds(const google::protobuf::Message& request);

}  // namespace axisd::server
