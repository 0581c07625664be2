// A core thread without a thread: handlers and timers run in virtual time, as fast as the machine can.
#pragma once

#include <atomic>
#include <functional>

#include "buses/clock.hpp"
#include "buses/task.hpp"
#include "daemon/core/core_loop.hpp"

namespace axisd::test {

class VirtualClock final : public Clock {
 public:
  /// Thread: any, as of the real clock.
  [[nodiscard]] TimePoint now() const override { return now_.load(std::memory_order_relaxed); }
  [[nodiscard]] WallTime wall(TimePoint t) const override {
    return WallTime(
        std::chrono::duration_cast<WallTime::duration>(t.time_since_epoch() + wall_ahead_.load()));
  }
  /// Somebody sets the wall clock: as far ahead of now(), counted from its epoch.
  void set_wall_ahead(Duration ahead) { wall_ahead_ = ahead; }
  [[nodiscard]] TimePoint next() const { return next_due(); }
  /// Time never goes back: what is asked for in the past is due now.
  void advance_to(TimePoint when) {
    if (when > now()) now_ = when;
    run_due(now());
  }

 private:
  void schedule(TimePoint) override {}
  std::atomic<Duration> wall_ahead_{Duration{}};
  std::atomic<TimePoint> now_{TimePoint(std::chrono::hours(1))};
};

class VirtualWorld {
 public:
  [[nodiscard]] core::CoreLoop& loop() { return loop_; }
  [[nodiscard]] Executor executor() { return loop_.executor(); }
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
      while (loop_.step())
        if (done()) return true;
      if (done()) return true;
      const auto next = clock_.next();
      if (next > end) break;
      clock_.advance_to(next);
    }
    clock_.advance_to(end);
    return done();
  }

 private:
  VirtualClock clock_;
  core::CoreLoop loop_{clock_};
};

}  // namespace axisd::test
