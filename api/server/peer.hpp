// What gRPC tells of a caller.
#pragma once

#include <string>

namespace axisd::server {

/// "ipv4:127.0.0.1:50312" to "127.0.0.1", "ipv6:%5B::1%5D:50312" to "::1", "unix:..." to "unix".
[[nodiscard]] std::string peer_host(const std::string& peer);

}  // namespace axisd::server
