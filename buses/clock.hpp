// Time is injected everywhere. This is the only place that asks the system for it or sleeps.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <utility>

namespace axisd {

using Duration = std::chrono::nanoseconds;
using TimePoint = std::chrono::steady_clock::time_point;
using WallTime = std::chrono::system_clock::time_point;

/// Runs callbacks at points in time. Thread: core (now() and wall(): any).
class Clock {
 public:
  /// Owns a pending callback; destroying or resetting it cancels the callback.
  class Timer {
   public:
    Timer() = default;
    Timer(Clock* clock, std::uint64_t id) : clock_(clock), id_(id) {}
    Timer(Timer&& other) noexcept : clock_(std::exchange(other.clock_, nullptr)), id_(other.id_) {}
    Timer& operator=(Timer&& other) noexcept {
      if (this != &other) {
        reset();
        clock_ = std::exchange(other.clock_, nullptr);
        id_ = other.id_;
      }
      return *this;
    }
    ~Timer() { reset(); }
    void reset() {
      if (clock_ != nullptr) std::exchange(clock_, nullptr)->cancel(id_);
    }

   private:
    Clock* clock_ = nullptr;
    std::uint64_t id_ = 0;
  };

  virtual ~Clock() = default;
  [[nodiscard]] virtual TimePoint now() const = 0;
  /// The wall-clock time that belongs to `t`.
  [[nodiscard]] virtual WallTime wall(TimePoint t) const = 0;
  /// Calls `callback` on the core thread at `when` or as soon after as possible, in order of time.
  [[nodiscard]] Timer call_at(TimePoint when, std::function<void()> callback);

 protected:
  /// Runs everything due at `now`; returns the time of the next callback, or TimePoint::max().
  TimePoint run_due(TimePoint now);
  [[nodiscard]] TimePoint next_due() const;
  /// The earliest pending callback became earlier: wake up at `when`.
  virtual void schedule(TimePoint when) = 0;

 private:
  void cancel(std::uint64_t id);
  using Key = std::pair<TimePoint, std::uint64_t>;
  std::map<Key, std::function<void()>> pending_;
  std::map<std::uint64_t, TimePoint> due_;
  std::uint64_t last_id_ = 0;
};

/// For threads of their own (bus workers, simulated lines): the same time base as the real clock.
TimePoint monotonic_now();
/// Blocks the calling thread until `when` with the best precision that the kernel gives (absolute, 1 ns
/// slack).
void block_until(TimePoint when);
/// Sets the calling thread's timer slack to 1 ns, so that its waits end on time.
void use_precise_waits();

}  // namespace axisd
