// The gRPC server of a machine.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "api/server/access.hpp"
#include "api/server/admission.hpp"
#include "api/tls/live.hpp"
#include "api/transport/knock.hpp"
#include "api/transport/peer_budgets.hpp"
#include "api/transport/stream_budget.hpp"
#include "buses/clock.hpp"
#include "buses/file_descriptor.hpp"
#include "devices/audit.hpp"
#include "devices/configuration_access.hpp"
#include "devices/machine.hpp"
#include "devices/state_copy.hpp"

namespace axisd::server {

struct ServerOptions {
  /// "HOST:PORT", "[IPV6]:PORT" or "unix:PATH".
  std::vector<std::string> listen{"localhost:7443"};
  /// Mutual TLS on all TCP addresses. Without it only loopback addresses; unix sockets are always plaintext.
  std::shared_ptr<const tls::Live> tls{};
  /// gRPC's reflection; without it its clients get UNIMPLEMENTED.
  bool reflection = false;
  Admission::Limits limits{};
  transport::PeerBudgets::Limits peers{};
  transport::StreamBudget::Limits streams{};
  /// A stream whose reader has not read for so long is cancelled.
  Duration stalled_reader_limit = std::chrono::seconds(2);
  /// Who may do what. nullptr: everybody everything.
  std::shared_ptr<const AccessControl> access{};
  /// What GetConfig, CheckConfig and ReloadConfig ask; outlives the server. nullptr: they are refused.
  ConfigurationAccess* configuration = nullptr;
  /// What ListAudit asks; outlives the server. nullptr: it is refused.
  AuditAccess* audit = nullptr;
  /// Is told of changes that are no commands; outlives the machine. nullptr: nobody is.
  AuditSink* audit_sink = nullptr;
  /// What BackUpState asks; outlives the server. nullptr: it is refused.
  StateCopies* state_copies = nullptr;
};

/// Serves one machine. start() and shutdown() on one thread, which is not one of gRPC's.
class Server {
 public:
  /// `machine` must outlive shutdown().
  Server(Machine& machine, ServerOptions options);
  /// Shuts down.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Begins to serve; returns the TCP port (of the first address; 0: unix sockets only). Once.
  /// Errors: invalid_argument (address), busy (address in use), offline (address refused by the
  /// system).
  [[nodiscard]] Result<int> start();

  /// Turns health to NOT_SERVING, ends all streams and waiting calls with UNAVAILABLE, then stops; takes
  /// `deadline` at most. Commands are not changed by it. Idempotent.
  void shutdown(Duration deadline = std::chrono::seconds(2));

  /// A connection of the daemon to itself, as from a unix socket, beyond server.limits.connections. Nothing
  /// open (get() < 0): out of descriptors. Precondition: start() returned a port. Thread: any.
  [[nodiscard]] FileDescriptor connect_inside();

  /// Full names of the services of ours that it serves. Thread: any.
  [[nodiscard]] std::vector<std::string> services() const;

  /// Of each address that it listens on, between start() and shutdown(); on their thread.
  [[nodiscard]] std::vector<std::shared_ptr<transport::Knock>> knocks() const;

  /// When its accept loop last came round: it lets in who connects. Thread: any.
  [[nodiscard]] TimePoint last_progress() const;

  /// When gRPC last took in a connection that it is given; now if it has them all. Thread: any.
  [[nodiscard]] TimePoint last_hand_over() const;

  /// Batches of axis states serialised since the start. Thread: any.
  [[nodiscard]] std::uint64_t batches_serialised() const;

 private:
  struct Parts;

  Machine& machine_;
  const ServerOptions options_;
  std::unique_ptr<Parts> parts_;
};

}  // namespace axisd::server
