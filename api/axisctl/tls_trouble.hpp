// Why there is no connection, where it is the certificates.
#pragma once

#include "api/axisctl/client.hpp"
#include "api/axisctl/error.hpp"

namespace axisd::axisctl {

/// The same failure in words of what is wrong with the certificates of either side, where it is that. Behind
/// its own words where something may have been sent: they say what is known of that.
/// Connects once more to see what the daemon shows, for a second at most: not for what may be repeated.
[[nodiscard]] Failure with_tls_trouble(const Failure& failure, const Connection& connection);

}  // namespace axisd::axisctl
