// A core thread without a thread: handlers and timers run in virtual time, as fast as the machine can.
#pragma once

#include <boost/asio/io_context.hpp>
#include <functional>

#include "buses/clock.hpp"
#include "buses/task.hpp"

namespace axisd::test {

class VirtualClock final : public Clock {
 public:
  [[nodiscard]] TimePoint now() const override { return now_; }
  [[nodiscard]] WallTime wall(TimePoint t) const override {
    return WallTime(std::chrono::duration_cast<WallTime::duration>(t.time_since_epoch()));
  }
  [[nodiscard]] TimePoint next() const { return next_due(); }
  void advance_to(TimePoint when) {
    now_ = when;
    run_due(when);
  }

 private:
  void schedule(TimePoint) override {}
  TimePoint now_ = TimePoint(std::chrono::hours(1));
};

class VirtualWorld {
 public:
  [[nodiscard]] Executor executor() { return io_.get_executor(); }
  [[nodiscard]] VirtualClock& clock() { return clock_; }
  [[nodiscard]] TimePoint now() const { return clock_.now(); }

  /// Runs everything that happens within `duration`.
  void run_for(Duration duration) {
    run_until([] { return false; }, duration);
  }

  /// Runs until `done`, at most `limit`. True: done.
  bool run_until(const std::function<bool()>& done, Duration limit) {
    const auto end = clock_.now() + limit;
    for (;;) {
      while (io_.poll_one() > 0)
        if (done()) return true;
      io_.restart();
      if (done()) return true;
      const auto next = clock_.next();
      if (next > end) break;
      clock_.advance_to(next);
    }
    clock_.advance_to(end);
    return done();
  }

 private:
  boost::asio::io_context io_;
  VirtualClock clock_;
};

}  // namespace axisd::test
