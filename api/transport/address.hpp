// Addresses of servers, as a configuration has them. Pure.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace axisd::transport {

/// Host and port of "localhost:7480" or "[::1]:7480". Nothing: it is neither.
struct HostAndPort {
  std::string host, port;
};
[[nodiscard]] std::optional<HostAndPort> host_and_port(std::string_view address);
/// Whether only this computer reaches it.
[[nodiscard]] bool is_loopback(const HostAndPort& address);
/// Where a daemon takes stops, unless its configuration says otherwise (stop_service.proto); empty: `server`
/// is no address with a port.
[[nodiscard]] std::string stop_lane_next_to(const std::string& server);

}  // namespace axisd::transport
