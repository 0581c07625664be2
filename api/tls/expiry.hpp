#pragma once

#include <string>

#include "buses/clock.hpp"
#include "buses/error.hpp"

namespace axisd::tls {

/// When the first of the certificates in a PEM file expires. Blocks for the disk. Errors: invalid_argument.
[[nodiscard]] Result<WallTime> first_expiry(const std::string& path);

}  // namespace axisd::tls
