#include "api/server/reply_thread.hpp"

#include <pthread.h>

#include <utility>

namespace axisd::server {

void ReplyThread::start(Ticker ticker) {
  thread_ = std::thread([this, ticker = std::move(ticker)] { run(ticker); });
  pthread_setname_np(thread_.native_handle(), "axisd-reply");
}

void ReplyThread::post(Job job) {
  {
    const std::lock_guard lock(mutex_);
    if (stopping_) return;
    jobs_.push_back(std::move(job));
    if (jobs_.size() > 1) return;  // the first one has woken the thread
  }
  wake_.notify_one();
}

void ReplyThread::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void ReplyThread::run(const Ticker& ticker) {
  std::vector<Job> batch;
  while (true) {
    const auto next = ticker(monotonic_now());
    {
      std::unique_lock lock(mutex_);
      const auto woken = [this] { return stopping_ || !jobs_.empty(); };
      if (next == TimePoint::max()) {
        wake_.wait(lock, woken);
      } else {
        wake_.wait_for(lock, next - monotonic_now(), woken);
      }
      if (stopping_ && jobs_.empty()) return;
      std::swap(batch, jobs_);
    }
    for (auto& job : batch) job();
    batch.clear();
  }
}

}  // namespace axisd::server
