// What gRPC counts of the streams of each connection.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace axisd::transport {

/// Of one connection, since it began.
struct StreamCount {
  std::int64_t started = 0, ended = 0;  ///< ended: gRPC has let go of it
  [[nodiscard]] std::int64_t open() const { return started - ended; }
};

/// What channelz tells as JSON of one connection. Nothing: it knows none.
[[nodiscard]] std::optional<StreamCount> streams_in(std::string_view socket);
/// One page of a server's connections, by their other end, added to `to`: channelz's numbers. Where the next
/// page begins; nothing: this was the last, or it cannot be read.
[[nodiscard]] std::optional<std::int64_t> sockets_in(std::string_view page, std::int64_t first,
                                                     std::map<std::string, std::int64_t>& to);

/// Asks gRPC's channelz, which counts streams by itself. Connections are known by their other end, as gRPC
/// writes it ("ipv4:127.0.0.1:40000"): those that a server of this process got from its acceptor. Thread: one
/// at a time.
class StreamCounts {
 public:
  /// Of each of these connections. Without those that gRPC does not have, or does not know yet.
  [[nodiscard]] std::map<std::string, StreamCount> of(const std::vector<std::string>& peers);
  /// It has ended: another one may come from there.
  void forget(const std::string& peer) { sockets_.erase(peer); }

 private:
  void learn();

  std::map<std::string, std::int64_t> sockets_;  ///< channelz's numbers
};

}  // namespace axisd::transport
