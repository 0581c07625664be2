// The server of an entrance.
#pragma once

#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>

#include <memory>
#include <vector>

#include "api/cell/callers.hpp"
#include "api/cell/cell.hpp"
#include "api/cell/cell_service.hpp"
#include "api/cell/forward.hpp"
#include "api/transport/accept_loop.hpp"

namespace axisd::cell {

/// Serves CellService, and passes on everything else. Thread: that which made it.
class Entrance {
 public:
  /// All of them outlive this. `live`: nullptr: without TLS.
  Entrance(Cell& cell, RouteTable& routes, OpenCalls& calls, const Settings& settings,
           std::shared_ptr<const tls::Live> live);
  ~Entrance();
  Entrance(const Entrance&) = delete;

  /// The port. Errors: as of transport::listen_on().
  [[nodiscard]] Result<int> open();
  /// Nobody is let in any more, and what is open ends. Blocks, for a second at most; the core has to run
  /// meanwhile.
  void close();
  /// As of transport::AcceptLoop. Thread: any.
  [[nodiscard]] TimePoint last_progress() const { return accept_.last_progress(); }
  [[nodiscard]] TimePoint last_hand_over() { return accept_.last_hand_over(); }

 private:
  const Settings& settings_;
  const std::shared_ptr<const tls::Live> live_;
  Callers callers_;
  CellServiceImpl service_;
  Forwarder forwarder_;
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor_;
  std::unique_ptr<grpc::Server> server_;
  transport::AcceptLoop accept_;
};

}  // namespace axisd::cell
