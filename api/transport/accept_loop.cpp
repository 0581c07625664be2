#include "api/transport/accept_loop.hpp"

#include <fcntl.h>
#include <malloc.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <pthread.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

#include "api/transport/peer_socket.hpp"
#include "buses/heartbeat.hpp"

namespace axisd::transport {
namespace {

// Kept free for serial ports that come back, state files and the like.
constexpr int kept_descriptors = 64;
/// A flood of requests lasts no longer before it is noticed: gRPC takes 100,000 a second, of some 10 KiB
/// each. That it is looked for costs a microsecond for each connection.
constexpr Duration count_every = std::chrono::milliseconds(20);
/// What has come and was not read yet cannot be taken back from gRPC. It is half of the longest message.
constexpr int receive_buffer = 128 * 1024;
constexpr Duration memory_every = heartbeat, trim_every = std::chrono::seconds(2);
constexpr std::size_t worth_trimming = std::size_t{16} * 1024 * 1024;

/// Of this process, bytes; 0: the system does not say.
std::size_t resident() {
  const FileDescriptor file(open("/proc/self/statm", O_RDONLY | O_CLOEXEC));
  std::array<char, 128> text{};
  if (file.get() < 0 || ::read(file.get(), text.data(), text.size() - 1) <= 0) return 0;
  unsigned long size = 0, pages = 0;
  if (std::sscanf(text.data(), "%lu %lu", &size, &pages) != 2) return 0;
  return pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

int descriptor_limit() {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  return static_cast<int>(std::min<rlim_t>(limit.rlim_cur, 1U << 20U));
}

}  // namespace

Result<void> AcceptLoop::start(std::vector<Entry> entries, const PeerBudgets::Limits& limits) {
  wake_ = FileDescriptor(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  reserve_ = FileDescriptor(open("/dev/null", O_RDONLY | O_CLOEXEC));
  if (wake_.get() < 0 || reserve_.get() < 0)
    return fail(Reason::internal,
                "cannot open descriptors for the accept loop: " + std::generic_category().message(errno),
                "raise LimitNOFILE of the service");
  // The kernel gives out the lowest free number, so the number of a new descriptor tells how many are open.
  first_refused_descriptor_ = std::max(reserve_.get() + 1, descriptor_limit() - kept_descriptors);
  budgets_.emplace(limits);
  memory_limit_ = limits.memory;
  resident_when_trimmed_ = resident();
  entries_ = std::move(entries);
  thread_ = std::thread([this] { run(); });
  pthread_setname_np(thread_.native_handle(), "axisd-accept");
  return {};
}

void AcceptLoop::stop() {
  if (thread_.joinable()) {
    stopping_ = true;
    eventfd_write(wake_.get(), 1);
    thread_.join();
  }
  entries_.clear();
}

std::vector<std::shared_ptr<Knock>> AcceptLoop::knocks() const {
  std::vector<std::shared_ptr<Knock>> all;
  all.reserve(entries_.size());
  for (const auto& entry : entries_) all.push_back(entry.socket.knock);
  return all;
}

void AcceptLoop::run() {
  std::vector<pollfd> polled;
  std::vector<PeerBudgets::Id> watched;
  while (!stopping_) {
    polled = {{.fd = wake_.get(), .events = POLLIN, .revents = 0}};
    for (const auto& entry : entries_)
      polled.push_back({.fd = entry.socket.fd.get(), .events = POLLIN, .revents = 0});
    watched.clear();
    for (const auto& [id, connection] : connections_) {
      polled.push_back({.fd = connection.get(), .events = POLLRDHUP, .revents = 0});
      watched.push_back(id);
    }
    progress_.store(monotonic_now(), std::memory_order_relaxed);
    const auto pause =
        std::chrono::ceil<std::chrono::milliseconds>(connections_.empty() ? heartbeat : count_every);
    if (poll(polled.data(), polled.size(), static_cast<int>(pause.count())) < 0 && errno != EINTR) {
      spdlog::error("accept loop: poll: {}", std::generic_category().message(errno));
      return;
    }
    for (std::size_t i = 0; i < watched.size(); ++i)
      if (polled[1 + entries_.size() + i].revents != 0) close(watched[i]);
    bool fine = true;
    for (std::size_t i = 0; i < entries_.size(); ++i)
      if (polled[i + 1].revents != 0) fine = accept_one(entries_[i]) && fine;
    if (const auto now = monotonic_now(); now - counted_ >= count_every) {
      counted_ = now;
      count_traffic(now);
      look_at_memory(now);
    }
    // The system is short of memory or descriptors: the connection waits in the backlog.
    if (!fine) poll(polled.data(), 1, 100);
  }
  connections_.clear();
}

/// gRPC closes its own descriptor by itself.
void AcceptLoop::close(PeerBudgets::Id connection) {
  budgets_->leave(connection);
  connections_.erase(connection);
}

void AcceptLoop::count_traffic(TimePoint now) {
  std::map<PeerBudgets::Id, PeerBudgets::Traffic> traffic;
  for (const auto& [id, connection] : connections_) traffic.emplace(id, traffic_of(connection.get()));
  for (const auto id : budgets_->count(traffic, now)) cut_off(id);
}

void AcceptLoop::cut_off(PeerBudgets::Id id) {
  const int connection = connections_.at(id).get();
  if (std::has_single_bit(++cut_off_))
    spdlog::warn(
        "a client at {} sends floods of requests that it wants no answers to: cut off ({} since start)",
        address_of_peer(connection), cut_off_);
  // By a reset, with all that was not read yet. After a shutdown gRPC would still read what comes, for as
  // long as the peer goes on.
  const sockaddr nobody{.sa_family = AF_UNSPEC, .sa_data = {}};
  if (::connect(connection, &nobody, sizeof nobody) != 0) ::shutdown(connection, SHUT_RDWR);
  close(id);
}

void AcceptLoop::look_at_memory(TimePoint now) {
  if (now - looked_ < memory_every) return;
  looked_ = now;
  const auto bytes = resident();
  if (bytes > memory_limit_)
    if (const auto most = budgets_->most_one_sided()) cut_off(*most);
  // It takes long where there is much, and who floods meanwhile would not be noticed. What is free is used
  // again first.
  if (!budgets_->calm(now)) trimmed_ = now;
  const bool worth_it = bytes >= resident_when_trimmed_ + worth_trimming || cut_off_ != cut_off_when_trimmed_;
  if (!worth_it || now - trimmed_ < trim_every) return;
  malloc_trim(0);
  trimmed_ = now;
  cut_off_when_trimmed_ = cut_off_;
  resident_when_trimmed_ = resident();
}

bool AcceptLoop::accept_one(const Entry& entry) {
  FileDescriptor connection(accept4(entry.socket.fd.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
  if (connection.get() < 0) {
    const auto code = errno;
    if (code == EMFILE || code == ENFILE) return turn_away(entry);
    return code != ENOBUFS && code != ENOMEM;  // the rest concerns one connection that is gone already
  }
  if (entry.socket.knock->let_in(connection.get())) return true;
  const auto address = address_of_peer(connection.get());
  FileDescriptor watched(fcntl(connection.get(), F_DUPFD_CLOEXEC, 0));
  const bool none_left = watched.get() < 0 || watched.get() >= first_refused_descriptor_;
  const auto now = monotonic_now();
  const bool counted = entry.socket.unix_path.empty();
  auto place = none_left ? PeerBudgets::Entry::full : budgets_->enter(++last_id_, address, now, counted);
  if (!none_left && place != PeerBudgets::Entry::granted && place != PeerBudgets::Entry::address_floods &&
      make_room(address, now))
    place = budgets_->enter(last_id_, address, now, counted);
  if (place != PeerBudgets::Entry::granted) {
    refuse(place, address);
    return true;
  }
  connections_.emplace(last_id_, std::move(watched));
  if (entry.socket.unix_path.empty()) {
    const int on = 1;
    setsockopt(connection.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    setsockopt(connection.get(), SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
  }
  entry.hand_over(std::move(connection));
  return true;
}

bool AcceptLoop::make_room(const std::string& address, TimePoint now) {
  // What was counted is some time old: those that have begun to speak since then stay.
  for (int look = 0; look < 8; ++look) {
    const auto id = budgets_->gives_way(address, now);
    if (!id) return false;
    const auto& connection = connections_.at(*id);
    if (!budgets_->still_gives_way(*id, traffic_of(connection.get()), now)) continue;
    if (std::has_single_bit(++gave_way_))
      spdlog::info("an idle connection from {} gives way to a new one from {} ({} since start)",
                   address_of_peer(connection.get()), address, gave_way_);
    ::shutdown(connection.get(), SHUT_RDWR);
    close(*id);
    return true;
  }
  return false;
}

void AcceptLoop::refuse(PeerBudgets::Entry why, const std::string& address) {
  const auto count = ++refused_;
  if (!std::has_single_bit(count)) return;
  const auto* reason = why == PeerBudgets::Entry::address_floods ? "it sends floods of requests"
                       : why == PeerBudgets::Entry::address_full
                           ? "it has three quarters of server.limits.connections"
                           : "server.limits.connections is reached";
  spdlog::warn("no place for a connection from {}, {}: {} turned away since start", address, reason, count);
}

bool AcceptLoop::turn_away(const Entry& entry) {
  reserve_ = {};
  FileDescriptor surplus(accept4(entry.socket.fd.get(), nullptr, nullptr, SOCK_CLOEXEC));
  const bool closed = surplus.get() >= 0;
  if (closed) (void)entry.socket.knock->let_in(surplus.get());
  surplus = {};
  reserve_ = FileDescriptor(open("/dev/null", O_RDONLY | O_CLOEXEC));
  if (!closed) return false;  // somebody else took the reserve meanwhile
  const auto count = ++refused_;
  if (std::has_single_bit(count))
    spdlog::error("out of file descriptors: {} connections turned away since start; raise LimitNOFILE",
                  count);
  return true;
}

}  // namespace axisd::transport
