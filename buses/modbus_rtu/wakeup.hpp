#pragma once

#include <atomic>
#include <ctime>

#include "buses/clock.hpp"

namespace axisd::modbus_rtu {

/// What reaches a worker while it waits. Thread: any.
class Wakeup {
 public:
  Wakeup();  ///< throws std::system_error when the process is out of descriptors
  Wakeup(const Wakeup&) = delete;
  ~Wakeup();
  /// Ends the worker's current wait, or the next one.
  void notify();
  /// Thread: the worker. Forgets notifications; the flags stay.
  void drain();
  /// Thread: the worker. Blocks until notified (and drains), or until `limit` has passed.
  void wait(Duration limit);
  [[nodiscard]] int descriptor() const { return descriptor_; }

  std::atomic<bool> cut{false};   ///< a stop waits: give up on a silent node past its turnaround_max
  std::atomic<bool> quit{false};  ///< the worker is to end

 private:
  int descriptor_;
};

/// For poll timeouts; a negative duration is none.
timespec to_timespec(Duration duration);

}  // namespace axisd::modbus_rtu
