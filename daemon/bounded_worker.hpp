#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

namespace axisd {

/// Does what may take its time, one job after the other, on a thread of its own, and never keeps more than so
/// many waiting. Thread: any.
class BoundedWorker {
 public:
  using Job = std::move_only_function<void()>;

  explicit BoundedWorker(std::size_t most);
  /// As close().
  ~BoundedWorker();
  BoundedWorker(const BoundedWorker&) = delete;

  /// False: so many wait already, or it is closed; the job is dropped.
  [[nodiscard]] bool post(Job job);
  /// Ends the job that runs and drops the others. Idempotent.
  void close();

 private:
  void run();

  const std::size_t most_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Job> jobs_;  // guarded by mutex_
  bool closing_ = false;  // guarded by mutex_
  std::thread thread_;
};

}  // namespace axisd
