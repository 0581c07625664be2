#include "daemon/core/ready_queue.hpp"

namespace axisd::core {

thread_local const ReadyQueue* ReadyQueue::here_ = nullptr;

/// A handler may own a sequence, and its end ask for something more.
void ReadyQueue::clear() {
  while (!waiting_.empty()) {
    const auto last = std::move(waiting_.front());
    waiting_.pop_front();
  }
}

void ReadyQueue::run_one() {
  auto next = std::move(waiting_.front());
  waiting_.pop_front();
  run(next);
}

void ReadyQueue::run_first(const std::function<void()>& handler) { run(handler); }

}  // namespace axisd::core
