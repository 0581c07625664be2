#pragma once

#include <boost/asio/execution.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <deque>
#include <functional>
#include <utility>

namespace axisd::core {

/// What the core thread has to do. An io_context would look for input before each handler, which costs a
/// system call each time: a sequence that is resumed takes several steps. What comes in by the io_context is
/// only entered here, so that the core's handlers run one at a time, and in their order but for run_first().
class ReadyQueue {
 public:
  /// What other threads ask for comes by `io`, and wakes it.
  explicit ReadyQueue(boost::asio::io_context& io) : io_(&io) {}
  ReadyQueue(const ReadyQueue&) = delete;
  ReadyQueue& operator=(const ReadyQueue&) = delete;

  /// While it lives this thread is the core.
  class Here {
   public:
    explicit Here(const ReadyQueue& queue) : before_(std::exchange(here_, &queue)) {}
    Here(const Here&) = delete;
    Here& operator=(const Here&) = delete;
    ~Here() { here_ = before_; }

   private:
    const ReadyQueue* before_;
  };

  /// This thread is the core, and runs a handler.
  [[nodiscard]] bool in_handler() const { return here_ == this && in_handler_; }
  [[nodiscard]] bool empty() const { return waiting_.empty(); }
  /// Runs the oldest. Precondition: not empty. Thread: core.
  void run_one();
  /// Runs `handler` before those that wait; sequences that it starts run to their first wait in it. Thread:
  /// core, in no handler.
  void run_first(const std::function<void()>& handler);
  /// Runs nothing any more; what handlers ask for when they are dropped goes to the io_context.
  void clear();
  /// Thread: any.
  template <class Function>
  void push(Function function) {
    if (here_ == this)
      waiting_.emplace_back(std::move(function));
    else
      boost::asio::post(*io_, [this, entered = std::move(function)]() mutable {
        waiting_.emplace_back(std::move(entered));
      });
  }
  [[nodiscard]] boost::asio::io_context& io() const { return *io_; }

 private:
  void run(auto& handler) {
    in_handler_ = true;
    handler();
    in_handler_ = false;
  }

  static thread_local const ReadyQueue* here_;
  boost::asio::io_context* io_;
  std::deque<std::move_only_function<void()>> waiting_;
  bool in_handler_ = false;
};

/// The executor of the core thread, as Asio's executors are. Thread: any.
class CoreExecutor {
 public:
  explicit CoreExecutor(ReadyQueue& queue) : queue_(&queue) {}

  template <class Function>
  void execute(Function&& function) const {
    if (!later_ && queue_->in_handler())
      std::forward<Function>(function)();
    else
      queue_->push(std::forward<Function>(function));
  }

  [[nodiscard]] boost::asio::execution_context& query(boost::asio::execution::context_t) const noexcept {
    return queue_->io();
  }
  [[nodiscard]] boost::asio::execution::blocking_t query(boost::asio::execution::blocking_t) const noexcept {
    if (later_) return boost::asio::execution::blocking.never;
    return boost::asio::execution::blocking.possibly;
  }
  [[nodiscard]] CoreExecutor require(boost::asio::execution::blocking_t::never_t) const noexcept {
    return {*queue_, true};
  }
  [[nodiscard]] CoreExecutor require(boost::asio::execution::blocking_t::possibly_t) const noexcept {
    return {*queue_, false};
  }
  friend bool operator==(const CoreExecutor& a, const CoreExecutor& b) noexcept = default;

 private:
  CoreExecutor(ReadyQueue& queue, bool later) : queue_(&queue), later_(later) {}
  ReadyQueue* queue_;
  bool later_ = false;  ///< never within the call
};

}  // namespace axisd::core
