// Memory that is free, back to the system.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <thread>

namespace axisd::transport {

/// Of this process, bytes; 0: the system does not say. Thread: any.
[[nodiscard]] std::size_t resident_memory();

/// What a flood took is free after it, and the C library keeps it, in as many places as there were threads;
/// the next flood takes as much again elsewhere. Giving it back takes long where there is much, so it has a
/// thread of its own.
class MemoryTrimmer {
 public:
  MemoryTrimmer() = default;
  ~MemoryTrimmer() { stop(); }
  MemoryTrimmer(const MemoryTrimmer&) = delete;
  MemoryTrimmer& operator=(const MemoryTrimmer&) = delete;

  /// Once.
  void start();
  /// Begins soon; once more if it is under way. Thread: any.
  void trim();
  /// Waits for what is under way. Idempotent.
  void stop();
  /// What was resident after the last time, bytes, told once; 0: nothing new, or the system does not say.
  /// Thread: any.
  [[nodiscard]] std::size_t take_left() { return left_.exchange(0, std::memory_order_relaxed); }

 private:
  /// Until it is wanted. False: it is to stop.
  bool wait();
  void run();

  std::mutex mutex_;
  std::condition_variable changed_;
  bool wanted_ = false, stopping_ = false;  ///< under mutex_
  std::atomic<std::size_t> left_{0};
  std::thread thread_;
};

}  // namespace axisd::transport
