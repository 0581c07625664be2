// When free memory is worth giving back to the system. Pure.
#pragma once

#include <chrono>
#include <cstddef>

#include "buses/clock.hpp"

namespace axisd::transport {

/// After memory has grown, or somebody has left who took much, it is tried a few times, later and later: gRPC
/// may take longer to let go than was waited for. Nothing else makes it due, however much is resident.
///
///   level -- has grown by `worth`, or told of what was let go --> owed -- tried `tries` times,
///     or nothing is left to give back --> level
///
/// Thread: one at a time.
class TrimPlan {
 public:
  static constexpr std::size_t worth = std::size_t{16} * 1024 * 1024;  ///< bytes
  static constexpr int tries = 5;
  static constexpr Duration first_pause = std::chrono::seconds(1);  ///< the next ones are twice as long each
  /// gRPC lets go of what a connection had within that time after its end.
  static constexpr Duration settled_after = std::chrono::milliseconds(400);

  /// `resident`: of this process, bytes, here and below; 0: the system does not say.
  explicit TrimPlan(std::size_t resident) : start_(resident), left_(resident) {}

  /// Somebody who had much is gone, or is being cut off.
  void let_go(TimePoint now);
  /// True: it is to be tried now, and counted as tried.
  [[nodiscard]] bool due(TimePoint now, std::size_t resident);
  /// It was tried.
  void trimmed(std::size_t resident);

 private:
  std::size_t start_;
  std::size_t left_;  ///< by the last try: what has grown since then counts
  int owed_ = 0;      ///< tries; 0: level
  Duration pause_ = first_pause;
  TimePoint next_{};
};

}  // namespace axisd::transport
