#include "api/transport/accept_loop.hpp"

#include <fcntl.h>
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
#include <bit>
#include <cerrno>
#include <ranges>
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
/// Bytes until a connection's streams are counted again: room for some hundred.
constexpr std::uint64_t count_streams_after = 1024;
/// Without further bytes: gRPC may have read only a part of what had come. At every look for so long, and now
/// and then for ever.
constexpr Duration still_read_for = std::chrono::milliseconds(200),
                   count_streams_again = std::chrono::seconds(1);
constexpr Duration memory_every = heartbeat, trim_first_after = std::chrono::seconds(1),
                   trim_last_after = std::chrono::seconds(64);
/// gRPC lets go of what a connection had within that time after its end.
constexpr Duration settled_after = std::chrono::milliseconds(400);
constexpr std::size_t worth_trimming = std::size_t{16} * 1024 * 1024;

int descriptor_limit() {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  return static_cast<int>(std::min<rlim_t>(limit.rlim_cur, 1U << 20U));
}

}  // namespace

Result<void> AcceptLoop::start(std::vector<Entry> entries, const PeerBudgets::Limits& limits,
                               InProgress in_progress) {
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
  in_progress_ = std::move(in_progress);
  entries_ = std::move(entries);
  trimmer_.start();
  hand_over_.start();
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
  hand_over_.stop();
  trimmer_.stop();
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
      polled.push_back({.fd = connection.fd.get(), .events = POLLRDHUP, .revents = 0});
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
  if (const auto found = connections_.find(connection); found != connections_.end()) {
    counts_.forget(found->second.peer);
    connections_.erase(found);
  }
  hand_over_.take_back(connection);
}

void AcceptLoop::count_traffic(TimePoint now) {
  std::map<PeerBudgets::Id, PeerBudgets::Traffic> traffic;
  for (const auto& [id, connection] : connections_) traffic.emplace(id, traffic_of(connection.fd.get()));
  for (const auto id : budgets_->count(traffic, now))
    cut_off(id, "sends floods of requests that it wants no answers to");
  count_streams(traffic, now);
}

void AcceptLoop::count_streams(const std::map<PeerBudgets::Id, PeerBudgets::Traffic>& traffic,
                               TimePoint now) {
  std::map<std::string, PeerBudgets::Id> asked;
  for (auto& [id, connection] : connections_) {
    if (traffic.at(id).received - connection.received_by_then >= count_streams_after) connection.spoke = now;
    const bool is_due = now - connection.spoke <= still_read_for || connection.streams.idle() > 0 ||
                        now - connection.counted >= count_streams_again;
    if (connection.peer.empty() || !is_due) continue;
    asked.emplace(connection.peer, id);
    connection.counted = now;
  }
  if (asked.empty()) return;
  const auto peers = std::views::keys(asked);
  const auto counts = counts_.open({peers.begin(), peers.end()});
  for (const auto& [peer, id] : asked) {
    const auto found = counts.find(peer);
    if (found == counts.end()) continue;  // gRPC does not have it yet
    auto& connection = connections_.at(id);
    connection.received_by_then = traffic.at(id).received;
    const auto open = found->second;
    connection.streams = {.open = open,
                          .in_progress = in_progress_ ? in_progress_(peer) : open,
                          .idle_before = connection.streams.idle()};
  }
  std::map<PeerBudgets::Id, OpenStreams> streams;
  for (const auto& [id, connection] : connections_) streams.emplace(id, connection.streams);
  for (const auto id : beyond(StreamLimits{}, streams)) {
    budgets_->blame(id, now);
    cut_off(id, "keeps too many streams open");
  }
}

void AcceptLoop::cut_off(PeerBudgets::Id id, std::string_view why) {
  const int connection = connections_.at(id).fd.get();
  if (std::has_single_bit(++cut_off_))
    spdlog::warn("a client at {} {}: cut off ({} since start)", address_of_peer(connection), why, cut_off_);
  reset(connection);
  close(id);
}

void AcceptLoop::look_at_memory(TimePoint now) {
  if (now - looked_ < memory_every) return;
  looked_ = now;
  const auto bytes = resident_memory();
  if (bytes > memory_limit_)
    if (const auto most = budgets_->most_one_sided())
      cut_off(*most, "has sent most without an answer, and memory is short");
  if (std::exchange(cut_off_when_looked_, cut_off_) != cut_off_) {
    cut_off_at_ = now;
    trim_pause_ = trim_first_after;
  }
  // gRPC may take longer to let go than was waited for: it is tried again, later and later.
  const bool worth_it = bytes >= trimmer_.least() + worth_trimming;
  if (!worth_it || now - cut_off_at_ < settled_after || now - trimmed_ < trim_pause_) return;
  trimmer_.trim();
  trimmed_ = now;
  trim_pause_ = std::min(2 * trim_pause_, trim_last_after);
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
  connections_.emplace(last_id_,
                       Connection{.fd = std::move(watched), .peer = grpc_name_of_peer(connection.get())});
  if (entry.socket.unix_path.empty()) {
    const int on = 1;
    setsockopt(connection.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    setsockopt(connection.get(), SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
  }
  hand_over_.hand_over(last_id_, entry.hand_over, std::move(connection));
  return true;
}

bool AcceptLoop::make_room(const std::string& address, TimePoint now) {
  // What was counted is some time old: those that have begun to speak since then stay.
  for (int look = 0; look < 8; ++look) {
    const auto id = budgets_->gives_way(address, now);
    if (!id) return false;
    const auto& connection = connections_.at(*id).fd;
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
