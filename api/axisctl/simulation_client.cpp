#include "api/axisctl/simulation_client.hpp"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>

#include "api/axisctl/error.hpp"

namespace axisd::axisctl {
namespace {

constexpr std::string_view where =
    "this works on the daemon's own computer, as its user or root, where drives are simulated";

Failure unreachable(std::string_view why, bool nothing_sent) {
  return {ExitCode::unreachable, fmt::format("the simulated drives do not answer: {}; {}", why, where),
          nothing_sent};
}

}  // namespace

SimulationClient::SimulationClient(std::string_view instance_id, std::chrono::nanoseconds timeout)
    : socket_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  // A name without a file: a zero comes first.
  const auto name = fmt::format("{}axisd-sim-{}", '\0', instance_id);
  if (socket_ < 0 || name.size() > sizeof(address.sun_path)) throw unreachable("no socket can be had", true);
  name.copy(address.sun_path, name.size());
  const auto limit = std::chrono::duration_cast<std::chrono::microseconds>(timeout).count();
  const timeval wait{.tv_sec = limit / 1'000'000, .tv_usec = limit % 1'000'000};
  setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &wait, sizeof(wait));
  setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &wait, sizeof(wait));
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
  if (connect(socket_, reinterpret_cast<const sockaddr*>(&address), size) == 0) return;
  const int number = errno;
  close(socket_);
  throw unreachable(std::strerror(number), true);
}

SimulationClient::~SimulationClient() { close(socket_); }

std::string SimulationClient::ask(std::string_view command) const {
  const auto line = fmt::format("{}\n", command);
  if (send(socket_, line.data(), line.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(line.size()))
    throw unreachable(std::strerror(errno), false);
  std::string reply;
  std::array<char, 1024> buffer{};
  while (!reply.ends_with('\n')) {
    const auto size = recv(socket_, buffer.data(), buffer.size(), 0);
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) throw unreachable(size == 0 ? "the connection was closed" : std::strerror(errno), false);
    reply.append(buffer.data(), static_cast<std::size_t>(size));
  }
  reply.pop_back();
  if (reply.starts_with("error ")) throw Failure(ExitCode::refused, reply.substr(6));
  return reply.size() > 3 ? reply.substr(3) : "";
}

}  // namespace axisd::axisctl
