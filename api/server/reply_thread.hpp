// The thread that answers clients.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "buses/clock.hpp"

namespace axisd::server {

/// Runs every Finish and StartWrite, which cost up to milliseconds and therefore never run on the core
/// thread, and the ticks of the watch hub. Handing over costs one short lock and, if the thread sleeps, one
/// wake-up.
class ReplyThread {
 public:
  using Job = std::move_only_function<void()>;
  /// Called before each wait with the time; does what is due and returns when it wants to be called again.
  using Ticker = std::function<TimePoint(TimePoint now)>;

  ReplyThread() = default;
  ~ReplyThread() { stop(); }
  ReplyThread(const ReplyThread&) = delete;
  ReplyThread& operator=(const ReplyThread&) = delete;

  void start(Ticker ticker);
  /// Thread: any. Jobs run in order of posting. Dropped after stop().
  void post(Job job);
  /// Runs what was posted until now, then ends the thread. Thread: any but this one. Idempotent.
  void stop();

 private:
  void run(const Ticker& ticker);

  std::mutex mutex_;
  std::condition_variable wake_;
  std::vector<Job> jobs_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace axisd::server
