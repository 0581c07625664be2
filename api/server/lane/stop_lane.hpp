// The stop lane: a port of its own by which stops reach the machine whatever happens at the main one.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "api/server/access.hpp"
#include "api/server/lane/crowd.hpp"
#include "api/server/lane/places.hpp"
#include "api/tls/live.hpp"
#include "api/transport/knock.hpp"
#include "buses/file_descriptor.hpp"
#include "devices/audit.hpp"
#include "devices/machine.hpp"

namespace axisd::server {

struct StopLaneOptions {
  std::string listen;             ///< "HOST:PORT", "[IPV6]:PORT" or "unix:PATH"
  lane::Crowd::Limits silent{};   ///< who has said nothing yet
  lane::Places::Limits limits{};  ///< everybody else
  // As of ServerOptions: the same for both.
  std::shared_ptr<const tls::Live> tls{};
  std::shared_ptr<const AccessControl> access{};
  AuditSink* audit_sink = nullptr;
};

/// Where the stop lane of a server is, unless it is told: the next port, or the path with ".stop" behind it;
/// of port 0, any. Clients go by the same rule. Precondition: an address that listen_on() takes.
[[nodiscard]] std::string stop_lane_of(const std::string& listen);

/// A gRPC server for the calls of lane::StopCalls alone, on one thread, which is none of gRPC's and shares
/// neither memory nor connections with it. Each call that has come whole is begun, whether or not its client
/// still waits. Whoever has asked for more stops than the core has got round to is read from again when it
/// has; of several the one that asked for least goes first. listen(), serve() and stop() on one thread.
class StopLane {
 public:
  /// Stops of axes that a client may have waiting for the core: some 0.1 s of its time.
  static constexpr std::size_t most_unserved = 4096;

  /// `machine` outlives stop().
  StopLane(Machine& machine, StopLaneOptions options);
  ~StopLane();
  StopLane(const StopLane&) = delete;

  /// Takes its address; whoever connects waits until serve(). Returns the TCP port (0: a unix socket). Once.
  /// Errors: as of listen_on().
  [[nodiscard]] Result<int> listen();
  /// Precondition: listen().
  void serve();
  /// Answers what waits as UNAVAILABLE, then ends. Idempotent.
  void stop();

  /// A connection of the daemon to itself, which has the place of a client of its own. Nothing open
  /// (get() < 0): out of descriptors. Precondition: listen(). Thread: any.
  [[nodiscard]] FileDescriptor connect_inside();

  /// As Server::knocks(), between listen() and stop().
  [[nodiscard]] std::vector<std::shared_ptr<transport::Knock>> knocks() const;

  /// When its thread last came round, at most 200 ms apart. Thread: any.
  [[nodiscard]] TimePoint last_progress() const;

 private:
  class Loop;
  Machine& machine_;
  const StopLaneOptions options_;
  std::shared_ptr<Loop> loop_;
  std::thread thread_;
};

}  // namespace axisd::server
