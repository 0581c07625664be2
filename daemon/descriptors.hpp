#pragma once

#include "buses/error.hpp"
#include "config/configuration.hpp"

namespace axisd {

/// Permits this process as many open file descriptors as it may have: the soft limit becomes the hard one.
void raise_descriptor_limit();

/// Whether that is enough for whatever `configuration` lets clients open: gRPC ends the process where it gets
/// none. Errors: invalid_argument, with both numbers.
Result<void> check_descriptor_limit(const config::Configuration& configuration);

}  // namespace axisd
