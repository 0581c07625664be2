#include "api/server/lane/stop_lane.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <pthread.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <exception>
#include <map>
#include <mutex>
#include <tuple>
#include <utility>

#include "api/server/lane/connection.hpp"
#include "api/server/lane/lobby.hpp"
#include "api/server/lane/stop_calls.hpp"
#include "api/server/local_peer.hpp"
#include "api/server/peer.hpp"
#include "api/server/status.hpp"
#include "api/transport/listen.hpp"
#include "buses/heartbeat.hpp"

namespace axisd::server {

using lane::Connection;
using lane::Crowd;
using lane::Lobby;
using lane::Places;
using lane::StopCalls;

namespace {

/// Until it is tried again to let somebody in, when the system has no descriptors.
constexpr Duration when_full = std::chrono::milliseconds(100);
/// Until it is looked again whether a client may be read from that had too many stops waiting.
constexpr Duration when_crowded = std::chrono::milliseconds(5);

Peer peer_called(const std::string& host, const std::string& address) {
  return {.name = "local:" + host, .address = address};
}

}  // namespace

std::string stop_lane_of(const std::string& listen) {
  if (listen.starts_with("unix:")) return listen + ".stop";
  const auto colon = listen.rfind(':');
  const int port = std::atoi(listen.c_str() + colon + 1);
  return fmt::format("{}:{}", listen.substr(0, colon), port == 0 ? 0 : port + 1);
}

class StopLane::Loop : public std::enable_shared_from_this<StopLane::Loop> {
 public:
  Loop(Machine& machine, const StopLaneOptions& options)
      : machine_(&machine),
        calls_(machine, options.access, options.audit_sink),
        lobby_(options.silent),
        places_(options.limits),
        tls_(options.tls) {
    if (wake_.get() < 0 || lobby_.fd() < 0) throw std::bad_alloc();
  }

  void open(std::vector<transport::ListeningSocket> sockets) { sockets_ = std::move(sockets); }

  void run();
  void stop() {
    stopping_ = true;
    eventfd_write(wake_.get(), 1);
  }
  void join(FileDescriptor socket) {
    {
      const std::lock_guard lock(mutex_);
      joining_.push_back(std::move(socket));
    }
    eventfd_write(wake_.get(), 1);
  }
  [[nodiscard]] std::vector<std::shared_ptr<transport::Knock>> knocks() const {
    std::vector<std::shared_ptr<transport::Knock>> all;
    all.reserve(sockets_.size());
    for (const auto& socket : sockets_) all.push_back(socket.knock);
    return all;
  }
  [[nodiscard]] TimePoint last_progress() const { return progress_.load(std::memory_order_relaxed); }

 private:
  using Id = Places::Id;
  struct Client {
    std::string host, address;
    std::optional<Peer> peer;  ///< once it is identified
    std::string certificate;   ///< in PEM format, once it is identified by one
    std::unique_ptr<Connection> connection;
  };
  struct Done {
    Id id;
    std::int32_t stream;
    StopCalls::Make make;
  };

  bool serve_once();
  [[nodiscard]] bool is_crowded(const Client& client) const;
  void serve_in_turn(std::vector<Id> ids);
  void accept_from(const transport::ListeningSocket& socket);
  bool let_in_who_speaks();
  void let_in_from_inside();
  Id enter(FileDescriptor socket, std::optional<Peer> peer, std::string address, Crowd::Origin origin);
  void serve(Id id);
  void begin(Id id, const lane::Http2::Call& call);
  void identify(Id id, Client& client);
  [[nodiscard]] Peer peer_of(const Client& client) const;
  void close(std::optional<Id> id);
  void post(Done done);
  void answer_what_is_done();
  void say_goodbye();

  Machine* machine_;
  StopCalls calls_;
  Lobby lobby_;
  Places places_;
  std::vector<transport::ListeningSocket> sockets_;
  const std::shared_ptr<const tls::Live> tls_;  ///< nullptr: there is none
  std::map<Id, Client> clients_;
  Id last_ = 0;
  std::uint64_t turned_away_ = 0;
  TimePoint full_until_{};  ///< nobody is let in: the system has no descriptors
  FileDescriptor wake_{eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)};
  std::atomic<bool> stopping_{false};
  std::atomic<TimePoint> progress_{monotonic_now()};
  std::mutex mutex_;
  std::vector<Done> done_;               ///< under mutex_
  std::vector<FileDescriptor> joining_;  ///< under mutex_; from inside the daemon
};

void StopLane::Loop::run() {
  while (!stopping_) {
    try {
      if (!serve_once()) break;
    } catch (const std::exception& error) {  // no memory: nobody keeps any here
      spdlog::critical("stop lane: {}; all of its connections are closed", error.what());
      clients_.clear();
      places_.clear();
      lobby_.clear();
    }
  }
  say_goodbye();
}

/// False: nothing can be waited for any more. Clients then find nobody here, and go to the main address.
bool StopLane::Loop::serve_once() {
  std::vector<pollfd> polled;
  std::vector<Id> ready;
  progress_.store(monotonic_now(), std::memory_order_relaxed);
  const bool full = monotonic_now() < full_until_;
  polled.push_back({.fd = wake_.get(), .events = POLLIN, .revents = 0});
  polled.push_back({.fd = lobby_.fd(), .events = POLLIN, .revents = 0});
  const auto doors = polled.size();
  for (const auto& socket : sockets_)
    polled.push_back({.fd = full ? -1 : socket.fd.get(), .events = POLLIN, .revents = 0});
  const auto first = polled.size();
  std::vector<Id> ids;
  ids.reserve(clients_.size());
  bool crowded = false;
  for (const auto& [id, client] : clients_) {
    const bool waits = is_crowded(client), writes = client.connection->wants_to_write();
    crowded = crowded || waits;
    const int events = (waits ? 0 : POLLIN) | (writes ? POLLOUT : 0);
    // With a negative descriptor poll does not tell of a hang-up either, which would be there each time.
    polled.push_back({.fd = events == 0 ? -1 : client.connection->fd(),
                      .events = static_cast<short>(events),
                      .revents = 0});
    ids.push_back(id);
  }
  const auto until = std::min<Duration>({full ? when_full : heartbeat, crowded ? when_crowded : heartbeat,
                                         std::min(places_.next_due(), lobby_.next_due()) - monotonic_now()});
  const auto patience = std::chrono::ceil<std::chrono::milliseconds>(std::max(until, Duration{}));
  if (poll(polled.data(), polled.size(), static_cast<int>(patience.count())) < 0 && errno != EINTR) {
    spdlog::critical("stop lane: poll: {}", std::generic_category().message(errno));
    return false;
  }
  if (polled[0].revents != 0) {
    eventfd_t count = 0;
    eventfd_read(wake_.get(), &count);
  }
  let_in_from_inside();
  answer_what_is_done();
  for (std::size_t i = 0; i < ids.size(); ++i)
    if (polled[first + i].revents != 0 && clients_.contains(ids[i]))  // it may have ended with its answer
      ready.push_back(ids[i]);
  serve_in_turn(std::move(ready));
  // Whoever speaks is let in before others come, who would otherwise push him out.
  if (polled[1].revents == 0 || let_in_who_speaks())
    for (std::size_t i = 0; i < sockets_.size(); ++i)
      if (polled[doors + i].revents != 0) accept_from(sockets_[i]);
  close(places_.overdue(monotonic_now()));
  lobby_.end_overdue(monotonic_now());
  return true;
}

/// The core has not got round to what it asked for.
bool StopLane::Loop::is_crowded(const Client& client) const {
  return client.peer && machine_->stops_waiting(client.peer->name) > most_unserved;
}

/// Whoever is known goes before strangers, whose handshakes cost a thousand times as much as a stop; of those
/// who are known whoever asked for least.
void StopLane::Loop::serve_in_turn(std::vector<Id> ids) {
  const auto now = monotonic_now();
  std::ranges::sort(ids, {}, [&](Id id) {
    const auto& client = clients_.at(id);
    return std::tuple(!client.peer, -client.connection->effort_left(now), id);
  });
  for (const auto id : ids) serve(id);
}

void StopLane::Loop::accept_from(const transport::ListeningSocket& socket) {
  if (lobby_.accept_from(socket, monotonic_now()) || lobby_.make_room()) return;
  // Out of descriptors: somebody makes room, so that whoever wants to stop comes in.
  const auto leaves = places_.least_needed();
  if (!leaves) full_until_ = monotonic_now() + when_full;
  close(leaves);
}

/// False: there may be more of them.
bool StopLane::Loop::let_in_who_speaks() {
  auto speakers = lobby_.take_speakers();
  for (auto& [socket, address, origin, local] : speakers.guests) {
    auto peer = local  ? std::optional(local_peer(socket.get()))
                : tls_ ? std::nullopt
                       : std::optional(peer_called(origin.address, address));
    // At once: whoever has begun his handshake does not make room for those who have not.
    serve(enter(std::move(socket), std::move(peer), std::move(address), std::move(origin)));
  }
  return speakers.all;
}

void StopLane::Loop::let_in_from_inside() {
  std::vector<FileDescriptor> joining;
  {
    const std::lock_guard lock(mutex_);
    joining.swap(joining_);
  }
  constexpr auto* inside = "daemon";
  for (auto& socket : joining)
    enter(std::move(socket), peer_called(inside, inside), inside, {.address = inside, .network = inside});
}

/// `peer`: nothing: whom its certificate names.
StopLane::Loop::Id StopLane::Loop::enter(FileDescriptor socket, std::optional<Peer> peer, std::string address,
                                         Crowd::Origin origin) {
  const auto id = ++last_;
  const auto now = monotonic_now();
  auto acceptor = peer ? nullptr : tls_->served()->acceptor;
  auto& client = clients_[id];
  client.host = origin.address;
  client.address = std::move(address);
  client.peer = std::move(peer);
  client.connection = std::make_unique<Connection>(
      std::move(socket), std::move(acceptor), [this, id](const lane::Http2::Call& call) { begin(id, call); },
      now);
  close(places_.enter(id, {.address = std::move(origin.address), .network = std::move(origin.network)}, now));
  if (client.peer) close(places_.identify(id, client.peer->name, true, now));
  return id;
}

/// Precondition: the connection is identified, by a certificate.
void StopLane::Loop::identify(Id id, Client& client) {
  client.certificate = client.connection->certificate().value_or("");
  client.peer = peer_of(client);
  close(places_.identify(id, client.peer->name, false, monotonic_now()));
}

/// As its certificate is judged now. Precondition: it is identified by one.
Peer StopLane::Loop::peer_of(const Client& client) const {
  auto known = tls_->served()->clients.of(client.certificate, machine_->wall(machine_->now()));
  return {.name = std::move(known.name), .address = client.address, .refusal = std::move(known.refusal)};
}

void StopLane::Loop::serve(Id id) {
  const auto found = clients_.find(id);
  if (found == clients_.end()) return;  // it made room
  auto& client = found->second;
  const auto now = monotonic_now();
  if (!(is_crowded(client) ? client.connection->write() : client.connection->read(now))) return close(id);
  if (client.connection->greeted()) places_.greeted(id);
  if (!client.peer && client.connection->identified()) identify(id, client);
  places_.used(id, now, client.connection->waiting());
}

void StopLane::Loop::begin(Id id, const lane::Http2::Call& call) {
  auto& client = clients_.at(id);
  // Bytes of the first request may come with the last ones of the handshake.
  if (!client.peer)
    identify(id, client);
  else if (!client.certificate.empty())
    client.peer = peer_of(client);
  places_.asked(id);
  calls_.start(call, *client.peer, [loop = weak_from_this(), id, stream = call.stream](StopCalls::Make make) {
    if (const auto alive = loop.lock()) alive->post({.id = id, .stream = stream, .make = std::move(make)});
  });
}

void StopLane::Loop::post(Done done) {
  {
    const std::lock_guard lock(mutex_);
    done_.push_back(std::move(done));
  }
  eventfd_write(wake_.get(), 1);
}

void StopLane::Loop::answer_what_is_done() {
  std::vector<Done> done;
  {
    const std::lock_guard lock(mutex_);
    done.swap(done_);
  }
  for (auto& each : done) {
    auto answer = each.make();  // also logs, whether or not the client is still there
    const auto found = clients_.find(each.id);
    if (found == clients_.end()) continue;
    auto& connection = *found->second.connection;
    connection.answer(each.stream, std::move(answer));
    if (!connection.write()) {
      close(each.id);
      continue;
    }
    places_.used(each.id, monotonic_now(), connection.waiting());
  }
}

void StopLane::Loop::close(std::optional<Id> id) {
  if (!id) return;
  const auto found = clients_.find(*id);
  if (found == clients_.end()) return;
  if (!found->second.peer)
    if (const auto count = ++turned_away_; std::has_single_bit(count))
      spdlog::info("stop lane: {} connections ended before anybody was identified on them, the last from {}",
                   count, found->second.host);
  places_.leave(*id);
  clients_.erase(found);
}

void StopLane::Loop::say_goodbye() {
  answer_what_is_done();
  for (auto& [id, client] : clients_) {
    client.connection->go_away();
    (void)client.connection->write();
  }
  clients_.clear();
  lobby_.clear();
  sockets_.clear();
}

StopLane::StopLane(Machine& machine, StopLaneOptions options)
    : machine_(machine), options_(std::move(options)) {}

StopLane::~StopLane() { stop(); }

Result<int> StopLane::listen() {
  auto sockets = transport::listen_on(options_.listen, options_.tls != nullptr);
  if (!sockets) return fail(std::move(sockets).error());
  const int port = sockets->front().port;
  loop_ = std::make_shared<Loop>(machine_, options_);
  loop_->open(*std::move(sockets));
  spdlog::info("stops are taken on {} as well", port == 0 ? options_.listen : fmt::format("port {}", port));
  return port;
}

void StopLane::serve() {
  thread_ = std::thread([loop = loop_] { loop->run(); });
  pthread_setname_np(thread_.native_handle(), "axisd-stops");
}

void StopLane::stop() {
  if (!thread_.joinable()) return;
  loop_->stop();
  thread_.join();
}

FileDescriptor StopLane::connect_inside() {
  auto [ours, theirs] = transport::connected_pair();
  if (ours.get() >= 0) loop_->join(std::move(theirs));
  return std::move(ours);
}

std::vector<std::shared_ptr<transport::Knock>> StopLane::knocks() const { return loop_->knocks(); }

TimePoint StopLane::last_progress() const { return loop_ ? loop_->last_progress() : monotonic_now(); }

}  // namespace axisd::server
