#include "api/transport/knock.hpp"

#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <utility>

namespace axisd::transport {
namespace {

/// The system repeats a connection that found nobody with growing pauses; this does not wait for these.
constexpr auto patience = std::chrono::seconds(1);

using GetName = int (*)(int, sockaddr*, socklen_t*);

/// Of one end of a connection; empty: it has none.
std::string name_by(GetName get_name, int fd) {
  sockaddr_storage name{};
  socklen_t size = sizeof name;
  if (get_name(fd, reinterpret_cast<sockaddr*>(&name), &size) != 0) return {};
  return {reinterpret_cast<const char*>(&name), size};
}

sockaddr_storage unpacked(const std::string& name) {
  sockaddr_storage address{};
  std::memcpy(&address, name.data(), std::min(name.size(), sizeof address));
  return address;
}

/// Where somebody on this computer finds who listens there.
std::string reached_by(const std::string& listening) {
  auto address = unpacked(listening);
  if (address.ss_family == AF_INET) {
    auto& host = reinterpret_cast<sockaddr_in&>(address).sin_addr.s_addr;
    if (host == htonl(INADDR_ANY)) host = htonl(INADDR_LOOPBACK);
  } else if (address.ss_family == AF_INET6) {
    auto& host = reinterpret_cast<sockaddr_in6&>(address).sin6_addr;
    if (IN6_IS_ADDR_UNSPECIFIED(&host)) host = in6addr_loopback;
  }
  return {reinterpret_cast<const char*>(&address), listening.size()};
}

/// A name of its own, by which the other end knows it. False: there is none left.
bool bind_beside(int fd, const std::string& target) {
  auto address = unpacked(target);
  auto size = static_cast<socklen_t>(target.size());
  if (address.ss_family == AF_INET)
    reinterpret_cast<sockaddr_in&>(address).sin_port = 0;
  else if (address.ss_family == AF_INET6)
    reinterpret_cast<sockaddr_in6&>(address).sin6_port = 0;
  else
    size = sizeof(sa_family_t);  // the system chooses one without a file
  return bind(fd, reinterpret_cast<const sockaddr*>(&address), size) == 0;
}

bool has_ended(int fd) {
  pollfd polled{.fd = fd, .events = 0, .revents = 0};
  return poll(&polled, 1, 0) != 0;
}

}  // namespace

Knock::Knock(int listening, std::string name)
    : name_(std::move(name)), target_(reached_by(name_by(&getsockname, listening))) {}

void Knock::knock() {
  const bool waits = unanswered_since_.load() != TimePoint::max();
  const auto now = monotonic_now();
  if (waits && now - knocked_at_ < patience && !has_ended(ours_.get())) return;
  const auto target = unpacked(target_);
  FileDescriptor fresh(socket(target.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  // Out of descriptors, or of ports: that says nothing of the address.
  if (fresh.get() < 0 || !bind_beside(fresh.get(), target_)) return;
  {
    const std::lock_guard lock(mutex_);
    from_ = name_by(&getsockname, fresh.get());
  }
  knocked_at_ = now;
  if (!waits) unanswered_since_ = now;
  // Whatever this says: the answer comes from the one that accepts.
  (void)connect(fresh.get(), reinterpret_cast<const sockaddr*>(&target),
                static_cast<socklen_t>(target_.size()));
  ours_ = std::move(fresh);
}

bool Knock::let_in(int connection) {
  unanswered_since_ = TimePoint::max();
  const auto from = name_by(&getpeername, connection);
  {
    const std::lock_guard lock(mutex_);
    if (from_.empty() || from != from_) return false;
    from_.clear();
  }
  got_in_ = true;
  const linger at_once{.l_onoff = 1, .l_linger = 0};  // leaves no TIME_WAIT behind
  setsockopt(connection, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
  return true;
}

TimePoint Knock::unanswered_since() const { return got_in_ ? unanswered_since_.load() : TimePoint::max(); }

}  // namespace axisd::transport
