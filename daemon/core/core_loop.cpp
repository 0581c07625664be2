#include "daemon/core/core_loop.hpp"

#include <boost/asio/post.hpp>
#include <utility>

namespace axisd::core {

void StopLane::request(AxisGate& gate, std::function<void()> serve) {
  gate.request_stop();
  {
    const std::lock_guard lock(mutex_);
    requests_.push_back(std::move(serve));
  }
  waiting_.store(true, std::memory_order_release);
  post(core_, [] {});  // wakes the loop, which looks at the lane first
}

void StopLane::drain() {
  if (!waiting_.exchange(false, std::memory_order_acq_rel)) return;
  std::vector<std::function<void()>> requests;
  {
    const std::lock_guard lock(mutex_);
    requests = std::exchange(requests_, {});
  }
  for (const auto& serve : requests) serve();
}

CoreLoop::CoreLoop()
    : work_(boost::asio::make_work_guard(io_)), clock_(&own_clock_.emplace(io_)), lane_(io_.get_executor()) {}

CoreLoop::CoreLoop(Clock& clock)
    : work_(boost::asio::make_work_guard(io_)), clock_(&clock), lane_(io_.get_executor()) {}

void CoreLoop::run() {
  last_progress_ = monotonic_now();
  for (;;) {
    lane_.drain();
    // At most a second asleep, so that the watchdog sees an idle loop alive.
    const auto ran = io_.run_one_for(std::chrono::seconds(1));
    if (io_.stopped()) break;
    auto began = monotonic_now();
    last_progress_.store(began, std::memory_order_relaxed);
    if (ran == 0) continue;
    while (!io_.stopped()) {
      lane_.drain();
      if (io_.poll_one() == 0) break;
      const auto ended = monotonic_now();
      const auto took = (ended - std::exchange(began, ended)).count();
      if (took > longest_.load(std::memory_order_relaxed)) longest_.store(took, std::memory_order_relaxed);
    }
  }
}

bool CoreLoop::step(bool wait) {
  lane_.drain();
  return (wait ? io_.run_one() : io_.poll_one()) > 0;
}

void CoreLoop::stop() { io_.stop(); }

}  // namespace axisd::core
