#include "api/transport/listen.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <cerrno>
#include <cstring>
#include <memory>
#include <string_view>
#include <system_error>
#include <utility>

#include "buses/port_number.hpp"

namespace axisd::transport {
namespace {

/// As many as the system allows: a unix socket whose backlog is full refuses at once.
constexpr int backlog = SOMAXCONN;

std::unexpected<Error> system_error(const std::string& address, std::string_view what) {
  const auto code = errno;
  Error error{
      .reason = code == EADDRINUSE ? Reason::busy : Reason::offline,
      .message = fmt::format("{}: cannot {}: {}", address, what, std::generic_category().message(code)),
      .remedy = code == EADDRINUSE ? "another program listens there: stop it or change server.listen"
                                   : "check server.listen"};
  error.where.native_code = static_cast<std::uint32_t>(code);
  return fail(std::move(error));
}

struct HostPort {
  std::string host, port;
};

Result<HostPort> split(const std::string& address) {
  const auto wrong = [&] {
    return fail(Reason::invalid_argument, fmt::format("{:?} is not an address to listen on", address),
                "write HOST:PORT, [IPV6]:PORT or unix:PATH");
  };
  const auto colon = address.rfind(':');
  if (colon == std::string::npos || colon == 0) return wrong();
  HostPort result{.host = address.substr(0, colon), .port = address.substr(colon + 1)};
  if (!port_number(result.port)) return wrong();
  if (result.host.starts_with('[') && result.host.ends_with(']'))
    result.host = result.host.substr(1, result.host.size() - 2);
  else if (result.host.contains(':'))
    return wrong();
  if (result.host.empty()) return wrong();
  return result;
}

bool is_loopback(const sockaddr& address) {
  if (address.sa_family == AF_INET)
    return (ntohl(reinterpret_cast<const sockaddr_in&>(address).sin_addr.s_addr) >> 24U) == 127;
  if (address.sa_family == AF_INET6)
    return IN6_IS_ADDR_LOOPBACK(&reinterpret_cast<const sockaddr_in6&>(address).sin6_addr);
  return false;
}

int bound_port(int fd) {
  sockaddr_storage bound{};
  socklen_t size = sizeof bound;
  getsockname(fd, reinterpret_cast<sockaddr*>(&bound), &size);
  return ntohs(bound.ss_family == AF_INET6 ? reinterpret_cast<sockaddr_in6&>(bound).sin6_port
                                           : reinterpret_cast<sockaddr_in&>(bound).sin_port);
}

// SO_REUSEADDR, so that a restart need not wait for old connections; never SO_REUSEPORT, with which a second
// daemon would get every other client.
Result<ListeningSocket> listen_tcp(const std::string& name, const addrinfo& info, int port, bool v6_only) {
  ListeningSocket result;
  result.fd = FileDescriptor(socket(info.ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (result.fd.get() < 0) return system_error(name, "open a socket");
  const int on = 1, only = v6_only ? 1 : 0;
  setsockopt(result.fd.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_storage target{};
  std::memcpy(&target, info.ai_addr, info.ai_addrlen);
  if (info.ai_family == AF_INET6) {
    setsockopt(result.fd.get(), IPPROTO_IPV6, IPV6_V6ONLY, &only, sizeof only);
    if (port != 0)
      reinterpret_cast<sockaddr_in6&>(target).sin6_port = htons(static_cast<std::uint16_t>(port));
  } else if (port != 0) {
    reinterpret_cast<sockaddr_in&>(target).sin_port = htons(static_cast<std::uint16_t>(port));
  }
  if (bind(result.fd.get(), reinterpret_cast<sockaddr*>(&target), info.ai_addrlen) != 0)
    return system_error(name, "bind");
  if (listen(result.fd.get(), backlog) != 0) return system_error(name, "listen");
  result.port = bound_port(result.fd.get());
  result.knock = std::make_shared<Knock>(result.fd.get(), name);
  return result;
}

Result<std::vector<ListeningSocket>> listen_tcp(const std::string& name, bool remote_allowed) {
  const auto parts = split(name);
  if (!parts) return fail(parts.error());
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* list = nullptr;
  if (const int failed = getaddrinfo(parts->host.c_str(), parts->port.c_str(), &hints, &list); failed != 0)
    return fail(Reason::offline, fmt::format("{}: cannot resolve: {}", name, gai_strerror(failed)),
                "check the host in server.listen");
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owner(list, freeaddrinfo);
  std::vector<ListeningSocket> sockets;
  std::optional<Error> unavailable;
  for (const auto* info = list; info != nullptr; info = info->ai_next) {
    if (!remote_allowed && !is_loopback(*info->ai_addr))
      return fail(Reason::invalid_argument, fmt::format("{}: plaintext is refused off the local host", name),
                  "configure server.tls, or listen on localhost or a unix socket");
    const bool several = list->ai_next != nullptr;
    auto socket = listen_tcp(name, *info, sockets.empty() ? 0 : sockets.front().port, several);
    if (socket) {
      sockets.push_back(*std::move(socket));
    } else if (socket.error().reason == Reason::busy) {
      return fail(std::move(socket).error());
    } else {
      unavailable = std::move(socket).error();  // a host without IPv6 still has localhost
    }
  }
  if (sockets.empty()) return fail(*std::move(unavailable));
  return sockets;
}

Result<std::vector<ListeningSocket>> listen_unix(const std::string& name, const std::string& path) {
  sockaddr_un target{};
  target.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof target.sun_path)
    return fail(Reason::invalid_argument,
                fmt::format("{}: the path of a unix socket has 1 to 107 bytes", name), "choose another path");
  path.copy(target.sun_path, sizeof target.sun_path - 1);
  const auto* address = reinterpret_cast<const sockaddr*>(&target);
  // A file that a killed daemon left behind is replaced; one that somebody answers on is in use.
  const FileDescriptor probe(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (probe.get() < 0) return system_error(name, "open a socket");
  if (connect(probe.get(), address, sizeof target) == 0) {
    errno = EADDRINUSE;
    return system_error(name, "bind");
  }
  struct stat existing{};
  if (errno == ECONNREFUSED && stat(path.c_str(), &existing) == 0 && S_ISSOCK(existing.st_mode))
    unlink(path.c_str());
  ListeningSocket result;
  result.fd = FileDescriptor(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (result.fd.get() < 0) return system_error(name, "open a socket");
  if (bind(result.fd.get(), address, sizeof target) != 0) return system_error(name, "bind");
  result.unix_path = path;
  if (chmod(path.c_str(), 0660) != 0)
    return system_error(name, "set the mode of");  // before anyone can connect
  if (listen(result.fd.get(), backlog) != 0) return system_error(name, "listen");
  result.knock = std::make_shared<Knock>(result.fd.get(), name);
  std::vector<ListeningSocket> sockets;
  sockets.push_back(std::move(result));
  return sockets;
}

}  // namespace

ListeningSocket::~ListeningSocket() {
  if (fd.get() >= 0 && !unix_path.empty()) unlink(unix_path.c_str());
}

Result<std::vector<ListeningSocket>> listen_on(const std::string& address, bool remote_allowed) {
  constexpr std::string_view scheme = "unix:";
  if (address.starts_with(scheme)) return listen_unix(address, address.substr(scheme.size()));
  return listen_tcp(address, remote_allowed);
}

std::pair<FileDescriptor, FileDescriptor> connected_pair() {
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends) != 0) return {};
  return {FileDescriptor(ends[0]), FileDescriptor(ends[1])};
}

}  // namespace axisd::transport
