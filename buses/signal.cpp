#include "buses/signal.hpp"

#include <boost/asio/async_result.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>

namespace axisd {

struct Signal::Waiter {
  std::function<void(bool)> resume;  // empty once it was called
  Clock::Timer timer;
  void complete(bool notified) {
    if (auto call = std::exchange(resume, nullptr)) call(notified);
  }
};

Task<bool> Signal::wait_until(TimePoint deadline) {
  auto start = [this, deadline](auto handler) {
    // std::function wants a copyable callable, an awaitable's handler can only be moved.
    auto shared = std::make_shared<decltype(handler)>(std::move(handler));
    auto waiter = std::make_shared<Waiter>();
    waiter->resume = [shared, executor = executor_](bool notified) {
      boost::asio::post(executor, [shared, notified] { std::move (*shared)(notified); });
    };
    if (deadline != TimePoint::max()) {
      waiter->timer = clock_->call_at(deadline, [weak = std::weak_ptr(waiter)] {
        if (auto locked = weak.lock()) locked->complete(false);
      });
    }
    std::erase_if(waiters_, [](const auto& known) { return !known->resume; });
    waiters_.push_back(std::move(waiter));
  };
  co_return co_await boost::asio::async_initiate<const boost::asio::use_awaitable_t<>&, void(bool)>(
      start, boost::asio::use_awaitable);
}

Task<> Signal::wait() { co_await wait_until(TimePoint::max()); }

void Signal::notify_all() {
  for (auto& waiter : std::exchange(waiters_, {})) {
    waiter->timer.reset();
    waiter->complete(true);
  }
}

Task<> let_others_run(const Executor& executor, Clock& clock) {
  Signal turn(executor, clock);
  post(executor, [&turn] { turn.notify_all(); });
  co_await turn.wait();
}

Task<> sleep_until(const Executor& executor, Clock& clock, TimePoint when) {
  Signal never(executor, clock);
  co_await never.wait_until(when);
}

}  // namespace axisd
