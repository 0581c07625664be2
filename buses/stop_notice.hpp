#pragma once

#include <atomic>

#include "buses/clock.hpp"

namespace axisd {

/// Says on the thread that takes stops in that one is on its way to the core, so that whoever is about to
/// send something else on that bus can wait a moment for it. Thread: any.
class StopNotice {
 public:
  void give(TimePoint now = monotonic_now()) { given_.store(now, std::memory_order_release); }
  /// When it was given last; long ago if never.
  [[nodiscard]] TimePoint given() const { return given_.load(std::memory_order_acquire); }

 private:
  std::atomic<TimePoint> given_{};
};

}  // namespace axisd
