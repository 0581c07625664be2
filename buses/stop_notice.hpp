#pragma once

#include <atomic>

#include "buses/clock.hpp"

namespace axisd {

/// Says on the thread that takes stops in that one is on its way to the core, so that whoever is about to
/// send something else on that bus can wait for it. Thread: any.
class StopNotice {
 public:
  void give(TimePoint now = monotonic_now()) {
    given_.store(now, std::memory_order_relaxed);
    pending_.fetch_add(1, std::memory_order_release);
  }
  /// One that was given has been served: what it asks of the bus is in the bus's hands. Thread: core.
  void take() { pending_.fetch_sub(1, std::memory_order_release); }
  /// One is on its way; given() is of that one, or of another.
  [[nodiscard]] bool pending() const { return pending_.load(std::memory_order_acquire) > 0; }
  /// When the last was given; long ago if never.
  [[nodiscard]] TimePoint given() const { return given_.load(std::memory_order_relaxed); }

 private:
  std::atomic<TimePoint> given_{};
  std::atomic<int> pending_{0};
};

}  // namespace axisd
