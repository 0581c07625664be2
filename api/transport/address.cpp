#include "api/transport/address.hpp"

#include <charconv>

namespace axisd::transport {

std::optional<HostAndPort> host_and_port(std::string_view address) {
  const auto colon = address.rfind(':');
  if (colon == std::string_view::npos || colon == 0) return std::nullopt;
  auto host = address.substr(0, colon);
  const auto port = address.substr(colon + 1);
  unsigned number = 0;
  const auto [read, error] = std::from_chars(port.data(), port.data() + port.size(), number);
  if (error != std::errc() || read != port.data() + port.size() || number > 65535) return std::nullopt;
  if (host.starts_with('[') && host.ends_with(']'))
    host = host.substr(1, host.size() - 2);
  else if (host.find(':') != std::string_view::npos)
    return std::nullopt;
  if (host.empty()) return std::nullopt;
  return HostAndPort{std::string(host), std::string(port)};
}

bool is_loopback(const HostAndPort& address) {
  return address.host == "localhost" || address.host == "::1" || address.host.starts_with("127.");
}

std::string stop_lane_next_to(const std::string& server) {
  if (server.starts_with("unix:")) return server + ".stop";
  const auto address = host_and_port(server);
  if (!address) return {};
  const auto next = std::stoi(address->port) + 1;
  if (next > 65535) return {};
  return server.substr(0, server.rfind(':') + 1) + std::to_string(next);
}

}  // namespace axisd::transport
