#include "api/server/peer.hpp"

#include <string_view>

namespace axisd::server {

std::string peer_host(const std::string& peer) {
  const std::string_view text = peer;
  const auto scheme = text.find(':');
  if (scheme == std::string_view::npos || !text.starts_with("ip")) return std::string(text.substr(0, scheme));
  const auto port = text.rfind(':');
  auto host =
      std::string(text.substr(scheme + 1, port > scheme ? port - scheme - 1 : std::string_view::npos));
  for (const std::string_view bracket : {"%5B", "%5D", "[", "]"})
    if (const auto at = host.find(bracket); at != std::string::npos) host.erase(at, bracket.size());
  // "localhost" is any of these, one this time and another the next: a repeated request has to be its own.
  const bool loopback = host == "::1" || host.starts_with("127.") || host.starts_with("::ffff:127.");
  return loopback ? "localhost" : host;
}

}  // namespace axisd::server
