#include "daemon/bounded_worker.hpp"

#include <utility>

#include "daemon/store/thread.hpp"

namespace axisd {

BoundedWorker::BoundedWorker(std::size_t most)
    : most_(most), thread_(store::start_thread("axisd-files", [this] { run(); })) {}

BoundedWorker::~BoundedWorker() { close(); }

bool BoundedWorker::post(Job job) {
  {
    const std::lock_guard lock(mutex_);
    if (closing_ || jobs_.size() >= most_) return false;
    jobs_.push_back(std::move(job));
  }
  wake_.notify_one();
  return true;
}

void BoundedWorker::close() {
  std::deque<Job> dropped;
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
    dropped.swap(jobs_);
  }
  wake_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void BoundedWorker::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait(lock, [this] { return closing_ || !jobs_.empty(); });
    if (closing_) return;
    auto job = std::move(jobs_.front());
    jobs_.pop_front();
    lock.unlock();
    job();
    job = {};  // what it holds may ask for more
    lock.lock();
  }
}

}  // namespace axisd
