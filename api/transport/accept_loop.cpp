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
#include <system_error>
#include <utility>

#include "api/transport/peer_socket.hpp"
#include "buses/heartbeat.hpp"

namespace axisd::transport {
namespace {

// Kept free for serial ports that come back, state files and the like.
constexpr int kept_descriptors = 64;
/// A flood of requests lasts no longer before it is noticed: gRPC takes some hundred in a millisecond, of
/// some 10 KiB each. That it is looked for costs a microsecond for each connection. More often where many
/// streams may have begun.
constexpr Duration count_usually = std::chrono::milliseconds(10), count_soon = std::chrono::milliseconds(5);
/// What has come and was not read yet cannot be taken back from gRPC. It is half of the longest message.
constexpr int receive_buffer = 128 * 1024;
/// With TLS and all that gRPC sends around it.
constexpr int most_of_a_stop = 4096;
constexpr std::string_view floods = "sends floods of requests that it wants no answers to";

int descriptor_limit() {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  return static_cast<int>(std::min<rlim_t>(limit.rlim_cur, 1U << 20U));
}

}  // namespace

Result<void> AcceptLoop::start(std::vector<Entry> entries, const PeerBudgets::Limits& limits,
                               const StreamBudget::Limits& streams, InProgress in_progress) {
  wake_ = FileDescriptor(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  reserve_ = FileDescriptor(open("/dev/null", O_RDONLY | O_CLOEXEC));
  if (wake_.get() < 0 || reserve_.get() < 0)
    return fail(Reason::internal,
                "cannot open descriptors for the accept loop: " + std::generic_category().message(errno),
                "raise LimitNOFILE of the service");
  // The kernel gives out the lowest free number, so the number of a new descriptor tells how many are open.
  first_refused_descriptor_ = std::max(reserve_.get() + 1, descriptor_limit() - kept_descriptors);
  budgets_.emplace(limits);
  streams_.emplace(streams);
  streams_of_one_ = streams.of_one;
  leaving_ = limits.leaving;
  in_progress_ = std::move(in_progress);
  entries_ = std::move(entries);
  memory_.start(limits.memory);
  tcp_.start();
  local_.start();
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
  tcp_.stop();
  local_.stop();
  memory_.stop();
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
      const bool has_left = connection.phase == Phase::left;
      const short asked = connection.phase == Phase::open ? POLLRDHUP : 0;  // POLLHUP is told unasked
      polled.push_back({.fd = has_left ? -1 : connection.fd->get(), .events = asked, .revents = 0});
      watched.push_back(id);
    }
    progress_.store(monotonic_now(), std::memory_order_relaxed);
    const auto pause =
        std::chrono::ceil<std::chrono::milliseconds>(connections_.empty() ? heartbeat : counting_.every);
    if (poll(polled.data(), polled.size(), static_cast<int>(pause.count())) < 0 && errno != EINTR) {
      spdlog::error("accept loop: poll: {}", std::generic_category().message(errno));
      return;
    }
    for (std::size_t i = 0; i < watched.size(); ++i)
      if (const auto told = polled[1 + entries_.size() + i].revents; told == POLLRDHUP)
        connections_.at(watched[i]).enter(Phase::listens, monotonic_now());
      else if (told != 0)
        on_end(watched[i]);
    bool fine = true;
    for (std::size_t i = 0; i < entries_.size(); ++i)
      if (polled[i + 1].revents != 0) fine = accept_one(entries_[i]) && fine;
    if (const auto now = monotonic_now(); now - counting_.last >= counting_.every) {
      counting_.last = now;
      count_traffic(now);
      look_at_leaving(now);
      for (auto* way : {&tcp_, &local_}) look_at_hand_over(*way, now);
      look_at_memory(now);
    }
    // The system is short of memory or descriptors: the connection waits in the backlog.
    if (!fine) poll(polled.data(), 1, 100);
  }
  connections_.clear();
}

void AcceptLoop::on_end(PeerBudgets::Id id) {
  const auto fd = connections_.at(id).fd;
  const auto beyond = budgets_->count({{id, traffic_of(fd->get())}}, monotonic_now());
  // Who goes may have left a Stop, and the flood may be that of others at its address.
  if (std::cmp_greater(unread_on(fd->get()), most_of_a_stop))
    for (const auto each : beyond) cut_off(each, floods);
  if (!connections_.contains(id)) return;
  // gRPC reads what a peer has left that is gone. That is right for a Stop, and too much where it may be more
  // streams than one may have.
  const bool leaves_much =
      std::cmp_greater(unread_on(fd->get()) / StreamBudget::least_bytes, streams_of_one_);
  if (leaves_much && !connections_.at(id).peer.empty())
    return cut_off(id, "leaves more than it may have open");
  // It may be a Stop. Until it is read its place is taken, so that nobody leaves more than he may.
  auto& connection = connections_.at(id);
  if (unread_on(fd->get()) > 0 && connection.way->has_waiting(id))
    return connection.enter(Phase::left, monotonic_now());
  close(id);
}

void AcceptLoop::look_at_leaving(TimePoint now) {
  std::vector<PeerBudgets::Id> taken, overdue;
  for (const auto& [id, connection] : connections_)
    if (connection.phase == Phase::left && !connection.way->has_waiting(id))
      taken.push_back(id);
    else if (connection.phase == Phase::listens && now - connection.since >= leaving_)
      overdue.push_back(id);
  for (const auto id : taken) close(id);
  for (const auto id : overdue) cut_off(id, "has ended its sending, and takes nothing any more");
}

/// gRPC closes its own descriptor by itself.
void AcceptLoop::close(PeerBudgets::Id connection) {
  budgets_->leave(connection);
  memory_.gone(streams_->leave(connection));
  if (const auto found = connections_.find(connection); found != connections_.end()) {
    found->second.way->take_back(connection);
    counts_.forget(found->second.peer);
    connections_.erase(found);
  }
}

void AcceptLoop::count_traffic(TimePoint now) {
  std::map<PeerBudgets::Id, PeerBudgets::Traffic> traffic;
  for (const auto& [id, connection] : connections_) traffic.emplace(id, traffic_of(connection.fd->get()));
  for (const auto id : budgets_->count(traffic, now)) cut_off(id, floods);
  count_streams(traffic, now);
}

void AcceptLoop::count_streams(const std::map<PeerBudgets::Id, PeerBudgets::Traffic>& traffic,
                               TimePoint now) {
  for (const auto& [id, total] : traffic) streams_->received(id, total.received);
  const auto asked = streams_->doubtful(now);
  counting_.every = asked.empty() ? count_usually : count_soon;
  if (asked.empty()) return;
  look_at_streams(asked, now);
  for (const auto id : streams_->beyond(now)) blame(id, "keeps too many streams open", now);
}

void AcceptLoop::look_at_streams(const std::vector<PeerBudgets::Id>& ids, TimePoint now) {
  std::vector<std::string> peers;
  std::map<PeerBudgets::Id, std::uint64_t> unread;  // before gRPC is asked: it reads on
  for (const auto id : ids) {
    const auto& connection = connections_.at(id);
    peers.push_back(connection.peer);
    unread.emplace(id, unread_on(connection.fd->get()));
  }
  const auto counts = counts_.of(peers);
  for (const auto& [id, bytes] : unread) {
    const auto& peer = connections_.at(id).peer;
    const auto found = counts.find(peer);
    if (found == counts.end()) {
      streams_->unknown(id, now);
      continue;
    }
    const auto& [started, ended] = found->second;
    const int in_progress = in_progress_ ? in_progress_(peer) : 0;
    streams_->seen(id, {.started = started, .ended = ended, .in_progress = in_progress}, bytes, now);
  }
}

void AcceptLoop::look_at_hand_over(HandOverThread& way, TimePoint now) {
  const auto kept = way.kept_by(now);
  if (!kept) return;
  const auto found = connections_.find(kept->id);
  // It has ended, and gRPC is still at what it had sent.
  if (found == connections_.end()) return reset(kept->watched->get());
  const auto address = found->second.address;
  blame(kept->id, "sends without a pause", now);
  // What else has come from there waits for the same.
  std::vector<PeerBudgets::Id> others;
  for (const auto& [other, connection] : connections_)
    if (connection.address == address && way.take_back(other)) others.push_back(other);
  for (const auto other : others) close(other);
}

/// Treats its address as after a flood of bytes, too.
void AcceptLoop::blame(PeerBudgets::Id id, std::string_view why, TimePoint now) {
  budgets_->blame(id, now);
  cut_off(id, why);
}

void AcceptLoop::cut_off(PeerBudgets::Id id, std::string_view why) {
  const auto& connection = connections_.at(id);
  if (std::has_single_bit(++tally_.cut_off))
    spdlog::warn("a client at {} {}: cut off ({} since start)", connection.address, why, tally_.cut_off);
  reset(connection.fd->get());
  memory_.let_go(monotonic_now());
  close(id);
}

void AcceptLoop::look_at_memory(TimePoint now) {
  memory_.look(now, [this] {
    if (const auto most = budgets_->most_one_sided())
      cut_off(*most, "has sent most without an answer, and memory is short");
  });
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
  const bool counted = entry.socket.unix_path.empty();  // on TCP
  auto place = none_left ? PeerBudgets::Entry::full : budgets_->enter(++last_id_, address, now, counted);
  if (!none_left && place != PeerBudgets::Entry::granted && place != PeerBudgets::Entry::address_floods &&
      make_room(address, now))
    place = budgets_->enter(last_id_, address, now, counted);
  if (place != PeerBudgets::Entry::granted) {
    refuse(place, address);
    return true;
  }
  const auto shared = std::make_shared<const FileDescriptor>(std::move(watched));
  const auto peer = grpc_name_of_peer(connection.get());
  auto& way = counted ? tcp_ : local_;
  connections_.emplace(last_id_, Connection{.fd = shared, .way = &way, .address = address, .peer = peer});
  if (!peer.empty()) streams_->enter(last_id_, address);
  if (counted) {
    const int on = 1;
    setsockopt(connection.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    setsockopt(connection.get(), SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
  }
  way.hand_over(last_id_, entry.hand_over, std::move(connection), shared);
  return true;
}

bool AcceptLoop::make_room(const std::string& address, TimePoint now) {
  // What was counted is some time old: those that have begun to speak since then stay.
  for (int look = 0; look < 8; ++look) {
    const auto id = budgets_->gives_way(address, now);
    if (!id) return false;
    const auto& connection = connections_.at(*id);
    if (!budgets_->still_gives_way(*id, traffic_of(connection.fd->get()), now)) continue;
    if (std::has_single_bit(++tally_.gave_way))
      spdlog::info("an idle connection from {} gives way to a new one from {} ({} since start)",
                   connection.address, address, tally_.gave_way);
    ::shutdown(connection.fd->get(), SHUT_RDWR);
    close(*id);
    return true;
  }
  return false;
}

void AcceptLoop::refuse(PeerBudgets::Entry why, const std::string& address) {
  const auto count = ++tally_.refused;
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
  const auto count = ++tally_.refused;
  if (std::has_single_bit(count))
    spdlog::error("out of file descriptors: {} connections turned away since start; raise LimitNOFILE",
                  count);
  return true;
}

}  // namespace axisd::transport
