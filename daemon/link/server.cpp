#include "daemon/link/server.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/time.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <string>
#include <string_view>

namespace axisd::link {
namespace {

constexpr int retry_ms = 500;
constexpr std::size_t longest_line = 128;

Result<std::string> read_line(int client) {
  std::array<char, longest_line> buffer;
  std::size_t filled = 0;
  while (filled < buffer.size()) {
    const auto length = ::recv(client, buffer.data() + filled, buffer.size() - filled, 0);
    if (length < 0 && errno == EINTR) continue;
    if (length <= 0) break;
    filled += static_cast<std::size_t>(length);
    const std::string_view text(buffer.data(), filled);
    if (const auto end = text.find('\n'); end != std::string_view::npos)
      return std::string(text.substr(0, end));
  }
  return fail(Reason::invalid_argument, "no line came", "send one line");
}

}  // namespace

void Server::serve_one() {
  pollfd ready{.fd = listener_.get(), .events = POLLIN, .revents = 0};
  if (::poll(&ready, 1, links_.owes() ? retry_ms : -1) == 0) return links_.retry();
  const FileDescriptor client(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
  if (client.get() < 0) return;
  const timeval limit{.tv_sec = patience.count(), .tv_usec = 0};
  ::setsockopt(client.get(), SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof(limit));
  ::setsockopt(client.get(), SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof(limit));
  const auto result = answer(client.get());
  const auto text = result ? std::string("ok\n")
                           : fmt::format("error {}; {}\n", result.error().message, result.error().remedy);
  if (!result) fmt::print(stderr, "refused: {}; {}\n", result.error().message, result.error().remedy);
  // A client that has gone has no use for the answer.
  static_cast<void>(::send(client.get(), text.data(), text.size(), MSG_NOSIGNAL));
}

Result<void> Server::answer(int client) {
  if (const auto peer = check_peer(client); !peer) return peer;
  const auto line = read_line(client);
  if (!line) return fail(line.error());
  const auto request = parse_request(*line);
  if (!request) return fail(request.error());
  auto served = links_.serve(*request);
  if (served && request->verb == Verb::cycle)
    fmt::print(stderr, "{} was taken down and up\n", request->interface);
  return served;
}

/// The socket's mode lets the daemon's group in; that alone does not make a daemon.
Result<void> Server::check_peer(int client) const {
  ucred peer{};
  socklen_t size = sizeof(peer);
  if (::getsockopt(client, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0 &&
      (peer.uid == 0 || peer.uid == user_))
    return {};
  return fail(Reason::misconfigured, fmt::format("user {} may not ask", peer.uid),
              "run axisd as the user that axisd-link was given");
}

}  // namespace axisd::link
