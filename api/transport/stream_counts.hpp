// What gRPC counts of the streams of each connection.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace axisd::transport {

/// Asks gRPC's channelz, which counts streams by itself and tells the counts as JSON: some 50 us for each
/// connection that is asked for. Connections are known by their other end, as gRPC writes it
/// ("ipv4:127.0.0.1:40000"): those that a server of this process got from its acceptor. Thread: one at a
/// time.
class StreamCounts {
 public:
  /// Of each of these connections, the streams that have begun and that gRPC has not let go of. Without those
  /// that gRPC does not have, or does not know yet.
  [[nodiscard]] std::map<std::string, std::int64_t> open(const std::vector<std::string>& peers);
  /// It has ended: another one may come from there.
  void forget(const std::string& peer) { sockets_.erase(peer); }

 private:
  void learn();

  std::map<std::string, std::int64_t> sockets_;  ///< channelz's ids
};

}  // namespace axisd::transport
