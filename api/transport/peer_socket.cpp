#include "api/transport/peer_socket.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <linux/sockios.h>
#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

namespace axisd::transport {

std::string counted_address(const sockaddr_storage& peer) {
  constexpr std::uint8_t loopback = 127;  // the first byte of 16 million addresses
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (peer.ss_family == AF_INET) {
    const auto& ipv4 = reinterpret_cast<const sockaddr_in*>(&peer)->sin_addr;
    if (ntohl(ipv4.s_addr) >> 24U == loopback) return "localhost";
    return inet_ntop(AF_INET, &ipv4, text.data(), text.size());
  }
  if (peer.ss_family != AF_INET6) return {};
  auto ipv6 = reinterpret_cast<const sockaddr_in6*>(&peer)->sin6_addr;
  const bool mapped = IN6_IS_ADDR_V4MAPPED(&ipv6) != 0;
  if (IN6_IS_ADDR_LOOPBACK(&ipv6) != 0 || (mapped && ipv6.s6_addr[12] == loopback)) return "localhost";
  // One network belongs to one computer as a rule. An IPv4 address in it is one as it is.
  if (!mapped) std::fill(ipv6.s6_addr + 8, ipv6.s6_addr + 16, std::uint8_t{0});
  return inet_ntop(AF_INET6, &ipv6, text.data(), text.size());
}

std::string address_of_peer(int connection) {
  sockaddr_storage peer{};
  socklen_t size = sizeof peer;
  if (getpeername(connection, reinterpret_cast<sockaddr*>(&peer), &size) != 0) return "gone";
  if (auto address = counted_address(peer); !address.empty()) return address;
  ucred user{};
  socklen_t length = sizeof user;
  if (getsockopt(connection, SOL_SOCKET, SO_PEERCRED, &user, &length) != 0) return "local";
  return fmt::format("user {}", user.uid);
}

std::string grpc_name_of_peer(int connection) {
  sockaddr_storage peer{};
  socklen_t size = sizeof peer;
  if (getpeername(connection, reinterpret_cast<sockaddr*>(&peer), &size) != 0) return {};
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (peer.ss_family == AF_INET) {
    const auto& ipv4 = reinterpret_cast<const sockaddr_in&>(peer);
    return fmt::format("ipv4:{}:{}", inet_ntop(AF_INET, &ipv4.sin_addr, text.data(), text.size()),
                       ntohs(ipv4.sin_port));
  }
  if (peer.ss_family != AF_INET6) return {};
  const auto& ipv6 = reinterpret_cast<const sockaddr_in6&>(peer);
  if (IN6_IS_ADDR_V4MAPPED(&ipv6.sin6_addr) != 0)
    return fmt::format("ipv4:{}:{}",
                       inet_ntop(AF_INET, ipv6.sin6_addr.s6_addr + 12, text.data(), text.size()),
                       ntohs(ipv6.sin6_port));
  // Brackets and % are escaped, as in an URI.
  const auto scope = ipv6.sin6_scope_id == 0 ? std::string() : fmt::format("%25{}", ipv6.sin6_scope_id);
  return fmt::format("ipv6:%5B{}{}%5D:{}", inet_ntop(AF_INET6, &ipv6.sin6_addr, text.data(), text.size()),
                     scope, ntohs(ipv6.sin6_port));
}

void reset(int connection) {
  const sockaddr nobody{.sa_family = AF_UNSPEC, .sa_data = {}};
  if (::connect(connection, &nobody, sizeof nobody) != 0) ::shutdown(connection, SHUT_RDWR);
}

namespace {

/// Who waits for something to read is told from so many bytes on. The system takes no more than it has room
/// for, and tells of less once it is told of that.
void tell_from(int connection, int bytes) {
  ::setsockopt(connection, SOL_SOCKET, SO_RCVLOWAT, &bytes, sizeof bytes);
}

}  // namespace

void hold_back(int connection) { tell_from(connection, std::numeric_limits<int>::max()); }
void let_go(int connection) { tell_from(connection, 1); }

std::uint64_t unread_on(int connection) {
  int bytes = 0;
  return ::ioctl(connection, SIOCINQ, &bytes) == 0 && bytes > 0 ? static_cast<std::uint64_t>(bytes) : 0;
}

PeerBudgets::Traffic traffic_of(int connection) {
  tcp_info info{};
  socklen_t size = sizeof info;
  if (getsockopt(connection, IPPROTO_TCP, TCP_INFO, &info, &size) != 0) return {};
  return {.received = info.tcpi_bytes_received, .sent = info.tcpi_bytes_sent};
}

}  // namespace axisd::transport
