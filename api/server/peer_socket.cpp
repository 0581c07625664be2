#include "api/server/peer_socket.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cstdint>

namespace axisd::server {

std::string address_of_peer(int connection) {
  sockaddr_storage peer{};
  socklen_t size = sizeof peer;
  auto* address = reinterpret_cast<sockaddr*>(&peer);
  if (getpeername(connection, address, &size) != 0) return "gone";
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (peer.ss_family == AF_INET) {
    const auto* ipv4 = reinterpret_cast<const sockaddr_in*>(&peer);
    return inet_ntop(AF_INET, &ipv4->sin_addr, text.data(), text.size());
  }
  if (peer.ss_family == AF_INET6) {
    auto ipv6 = reinterpret_cast<const sockaddr_in6*>(&peer)->sin6_addr;
    // One network belongs to one computer as a rule. An IPv4 address in it is one as it is.
    if (IN6_IS_ADDR_V4MAPPED(&ipv6) == 0) std::fill(ipv6.s6_addr + 8, ipv6.s6_addr + 16, std::uint8_t{0});
    return inet_ntop(AF_INET6, &ipv6, text.data(), text.size());
  }
  ucred user{};
  socklen_t length = sizeof user;
  if (getsockopt(connection, SOL_SOCKET, SO_PEERCRED, &user, &length) != 0) return "local";
  return fmt::format("user {}", user.uid);
}

PeerBudgets::Traffic traffic_of(int connection) {
  tcp_info info{};
  socklen_t size = sizeof info;
  if (getsockopt(connection, IPPROTO_TCP, TCP_INFO, &info, &size) != 0) return {};
  return {.received = info.tcpi_bytes_received, .sent = info.tcpi_bytes_sent};
}

}  // namespace axisd::server
