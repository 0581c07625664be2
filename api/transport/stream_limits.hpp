// How many streams may be open. Pure.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <vector>

namespace axisd::transport {

/// Streams that gRPC has open on a connection: each costs some 12 KiB, however few bytes began it, and more
/// while it ends.
struct OpenStreams {
  std::int64_t open = 0;
  std::int64_t in_progress = 0;  ///< of them, calls that their service is at
  std::int64_t idle_before = 0;  ///< when they were counted before
  /// Those that only the client keeps open: half of a request, or an answer that it does not read.
  [[nodiscard]] std::int64_t idle() const { return open > in_progress ? open - in_progress : 0; }
  /// That were not only passing by when they were counted.
  [[nodiscard]] std::int64_t lasting() const { return std::min(idle(), idle_before); }
};

struct StreamLimits {
  /// What a client is told. gRPC 1.51 holds only those to it that acknowledge its settings.
  static constexpr int told = 2048;
  /// On one connection. More than `told`: streams that have ended are counted until gRPC has let go of them.
  std::int64_t of_one = told + 1024;
  std::int64_t idle = 3072;  ///< on all connections together
};

/// The connections to cut off, by their ids: who has more streams than one may have; and where there are too
/// many idle ones, who has most of these. Calls in progress cut off nobody.
[[nodiscard]] std::vector<std::uint64_t> beyond(const StreamLimits& limits,
                                                const std::map<std::uint64_t, OpenStreams>& connections);

}  // namespace axisd::transport
