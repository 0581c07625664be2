#include "daemon/core/core_loop.hpp"

#include <boost/asio/post.hpp>
#include <utility>

namespace axisd::core {
namespace {

constexpr auto longest_sleep = std::chrono::seconds(1);

}  // namespace

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
    : work_(boost::asio::make_work_guard(io_)),
      clock_(&own_clock_.emplace(io_, AsioClock::Served::by_loop)),
      lane_(io_.get_executor()) {}

CoreLoop::CoreLoop(Clock& clock)
    : work_(boost::asio::make_work_guard(io_)), clock_(&clock), lane_(io_.get_executor()) {}

void CoreLoop::run() {
  // At most a second asleep, so that the watchdog sees an idle loop alive.
  Clock::Timer beat;
  const std::function<void()> beats = [&] { beat = clock_->call_at(clock_->now() + longest_sleep, beats); };
  beats();
  auto began = monotonic_now();
  while (!io_.stopped()) {
    last_progress_.store(began, std::memory_order_relaxed);
    lane_.drain();
    // What is due comes before handlers: frames that wait to be read can be read a little later, SYNC cannot
    // be sent late.
    const bool served = own_clock_->serve(began);
    const bool ran = io_.poll_one() > 0;
    if (served || ran) {
      const auto ended = monotonic_now();
      const auto took = (ended - std::exchange(began, ended)).count();
      if (took > longest_.load(std::memory_order_relaxed)) longest_.store(took, std::memory_order_relaxed);
    }
    if (ran) continue;
    own_clock_->wake_in_time();
    io_.run_one();
    began = monotonic_now();
  }
}

bool CoreLoop::step(bool wait) {
  lane_.drain();
  return (wait ? io_.run_one() : io_.poll_one()) > 0;
}

void CoreLoop::stop() { io_.stop(); }

}  // namespace axisd::core
