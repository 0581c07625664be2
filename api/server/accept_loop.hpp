// The daemon's own accept loop.
#pragma once

#include <grpcpp/server_builder.h>

#include <atomic>
#include <memory>
#include <thread>
#include <vector>

#include "api/server/listen.hpp"

namespace axisd::server {

/// Accepts connections and hands them to gRPC. gRPC 1.51's own listener never accepts again after one EMFILE
/// (CVE-2023-4785); this one keeps a descriptor in reserve, turns the surplus connection away and goes on.
class AcceptLoop {
 public:
  using Acceptor = grpc::experimental::ExternalConnectionAcceptor;
  struct Entry {
    ListeningSocket socket;
    Acceptor* acceptor = nullptr;  ///< outlives the loop
  };

  AcceptLoop() = default;
  ~AcceptLoop() { stop(); }
  AcceptLoop(const AcceptLoop&) = delete;
  AcceptLoop& operator=(const AcceptLoop&) = delete;

  /// Connections beyond `most` (about: it is the number of descriptors that is bounded) are closed at once.
  Result<void> start(std::vector<Entry> entries, int most);
  /// Closes the listening sockets. Idempotent.
  void stop();

  /// Connections turned away since the start. Thread: any.
  [[nodiscard]] std::uint64_t refused() const { return refused_.load(std::memory_order_relaxed); }

 private:
  void run();
  /// False: nothing could be accepted, and trying again at once would spin.
  bool accept_one(const Entry& entry);
  bool turn_away(const Entry& entry);

  std::vector<Entry> entries_;
  int first_refused_descriptor_ = 0;
  FileDescriptor wake_, reserve_;
  std::atomic<std::uint64_t> refused_{0};
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace axisd::server
