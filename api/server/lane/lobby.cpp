#include "api/server/lane/lobby.hpp"

#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <spdlog/spdlog.h>
#include <sys/epoll.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <utility>

#include "api/server/peer.hpp"
#include "api/transport/peer_socket.hpp"

namespace axisd::server::lane {

namespace {

/// Closed at once of those who have been silent for too long.
constexpr int most_overdue = 16;

Crowd::Limits within_descriptors(Crowd::Limits limits) {
  constexpr std::size_t share = 16;
  rlimit descriptors{};
  if (getrlimit(RLIMIT_NOFILE, &descriptors) == 0)
    limits.most = std::min<std::size_t>(limits.most, descriptors.rlim_cur / share);
  return limits;
}

/// As gRPC writes it.
std::string text_of(const sockaddr_storage& address, socklen_t size) {
  char host[NI_MAXHOST]{}, port[NI_MAXSERV]{};
  if (address.ss_family == AF_UNIX) return "unix:";
  if (getnameinfo(reinterpret_cast<const sockaddr*>(&address), size, host, sizeof host, port, sizeof port,
                  NI_NUMERICHOST | NI_NUMERICSERV) != 0)
    return "ipv4:unknown:0";
  return address.ss_family == AF_INET6 ? fmt::format("ipv6:[{}]:{}", host, port)
                                       : fmt::format("ipv4:{}:{}", host, port);
}

/// Answers go at once, and a client that is gone is noticed.
void keep_alive(int connection) {
  const int on = 1, patience_ms = 10'000;
  setsockopt(connection, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  setsockopt(connection, SOL_SOCKET, SO_KEEPALIVE, &on, sizeof on);
  setsockopt(connection, IPPROTO_TCP, TCP_USER_TIMEOUT, &patience_ms, sizeof patience_ms);
}

bool has_spoken(int connection) {
  char byte = 0;
  return recv(connection, &byte, 1, MSG_PEEK | MSG_DONTWAIT) == 1;
}

}  // namespace

Lobby::Lobby(Crowd::Limits limits)
    : told_(epoll_create1(EPOLL_CLOEXEC)), crowd_(within_descriptors(limits)) {}

bool Lobby::accept_from(const transport::ListeningSocket& socket, TimePoint now) {
  for (int i = 0; i < most_accepted; ++i) {
    sockaddr_storage address{};
    socklen_t size = sizeof address;
    FileDescriptor connection(
        accept4(socket.fd.get(), reinterpret_cast<sockaddr*>(&address), &size, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (connection.get() < 0)
      return errno != EMFILE && errno != ENFILE && errno != ENOMEM && errno != ENOBUFS;
    if (socket.knock->let_in(connection.get())) continue;
    auto text = text_of(address, size);
    Crowd::Origin origin{.address = peer_host(text), .network = transport::address_of_peer(connection.get())};
    enter({.socket = std::move(connection),
           .address = std::move(text),
           .origin = std::move(origin),
           .local = !socket.unix_path.empty()},
          now);
  }
  return true;
}

void Lobby::enter(Guest guest, TimePoint now) {
  const auto id = ++last_;
  epoll_event event{.events = EPOLLIN | EPOLLRDHUP, .data = {.u64 = id}};
  if (epoll_ctl(told_.get(), EPOLL_CTL_ADD, guest.socket.get(), &event) != 0) return;  // no memory
  auto origin = guest.origin;
  guests_.emplace(id, std::move(guest));
  if (const auto leaves = crowd_.enter(id, std::move(origin), now)) close(*leaves);
}

Lobby::Speakers Lobby::take_speakers() {
  std::array<epoll_event, most_told> events;
  const int count = epoll_wait(told_.get(), events.data(), most_told, 0);
  Speakers speakers{.guests = {}, .all = count < most_told};
  for (int i = 0; i < count; ++i) {
    const std::uint64_t told = events[static_cast<std::size_t>(i)].data.u64;  // it is packed: no reference
    const auto found = guests_.find(told);
    if (found == guests_.end()) continue;
    const auto id = found->first;
    const int socket = found->second.socket.get();
    if (!has_spoken(socket)) {
      close(id);
      continue;
    }
    epoll_ctl(told_.get(), EPOLL_CTL_DEL, socket, nullptr);
    if (!found->second.local) keep_alive(socket);
    speakers.guests.push_back(std::move(found->second));
    crowd_.leave(id);
    guests_.erase(found);
  }
  return speakers;
}

void Lobby::end_overdue(TimePoint now) {
  for (int i = 0; i < most_overdue; ++i) {
    const auto id = crowd_.overdue(now);
    if (!id) return;
    close(*id);
  }
}

bool Lobby::make_room() {
  const auto id = crowd_.least_needed();
  if (id) close(*id);
  return id.has_value();
}

void Lobby::close(Id id) {
  const auto found = guests_.find(id);
  if (const auto count = ++closed_; std::has_single_bit(count))
    spdlog::info("stop lane: {} connections ended on which nothing was said, the last from {}", count,
                 found->second.origin.address);
  crowd_.leave(id);
  guests_.erase(found);
}

void Lobby::clear() {
  guests_.clear();
  crowd_.clear();
}

}  // namespace axisd::server::lane
