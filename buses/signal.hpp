#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "buses/clock.hpp"
#include "buses/task.hpp"

namespace axisd {

/// Wakes every coroutine that waits for it. Thread: core.
class Signal {
 public:
  Signal(Executor executor, Clock& clock) : executor_(std::move(executor)), clock_(&clock) {}
  /// Waits for the next notify_all() (true) or for `deadline` (false), whichever is first.
  Task<bool> wait_until(TimePoint deadline);
  Task<> wait();
  void notify_all();

 private:
  struct Waiter;
  Executor executor_;
  Clock* clock_;
  std::vector<std::shared_ptr<Waiter>> waiters_;
};

/// Suspends the calling coroutine until all that is ready to run has run. Thread: core.
Task<> let_others_run(const Executor& executor, Clock& clock);

/// Suspends the calling coroutine until `when`. Thread: core.
Task<> sleep_until(const Executor& executor, Clock& clock, TimePoint when);

/// A value that is delivered once to one waiting coroutine. Thread: core.
template <class T>
class Promise {
 public:
  Promise(Executor executor, Clock& clock) : signal_(std::move(executor), clock) {}
  void set(T value) {
    value_ = std::make_unique<T>(std::move(value));
    signal_.notify_all();
  }
  Task<T> get() {
    while (!value_) co_await signal_.wait();
    co_return std::move(*value_);
  }

 private:
  Signal signal_;
  std::unique_ptr<T> value_;
};

}  // namespace axisd
