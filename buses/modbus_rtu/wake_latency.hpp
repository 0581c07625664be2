#pragma once

#include <algorithm>
#include <utility>

#include "buses/clock.hpp"

namespace axisd::modbus_rtu {

/// A wait that ended later than this counts as one that ended so late.
constexpr Duration longest_latency = std::chrono::microseconds(100);

/// How late the timed waits of a thread usually end: half of them later, half of them sooner. For whom waking
/// too soon does no harm. Pure.
class UsualLatency {
 public:
  /// So far one wait moves it.
  static constexpr Duration step = std::chrono::nanoseconds(500);

  /// What to ask for in place of `when`.
  [[nodiscard]] TimePoint asked_for(TimePoint when) const { return when - usual_; }

  /// A wait that was to end at `asked` ended at `woken`.
  void note(TimePoint asked, TimePoint woken) {
    usual_ = std::clamp(usual_ + (woken - asked > usual_ ? step : -step), Duration::zero(), longest_latency);
  }

 private:
  Duration usual_{};
};

/// How late they end at the least: so long the bytes that woke a thread have lain there, too. Keeps to the
/// least of the last waits. Pure.
class LeastLatency {
 public:
  /// Waits after which a machine that has become slower is taken for that.
  static constexpr int remembered = 64;
  /// Of how late a wait for bytes has ended, no more than this is relied upon: it shortens a silence. Should
  /// it be wrong, that is 0.3 % of the 1.75 ms, where a receiver bears 2 % in the bit rate (Modbus over
  /// serial line 3.2).
  static constexpr Duration surely = std::chrono::microseconds(5);

  /// When that came for which a thread waited from `looked` on, and which it saw at `seen`: to be woken by it
  /// took about as long as to be woken by a clock. No more than `surely` too soon, whatever
  /// happened.
  [[nodiscard]] TimePoint came_by(TimePoint looked, TimePoint seen) const {
    const auto late = known_ ? std::min(least_, surely) : Duration::zero();
    return seen - looked > late ? seen - late : seen;  // else it did not sleep
  }

  /// A wait that was to end at `asked` ended at `woken`.
  void note(TimePoint asked, TimePoint woken) {
    const auto late = std::clamp(woken - asked, Duration::zero(), longest_latency);
    least_ = std::min(least_, late);
    least_lately_ = std::min(least_lately_, late);
    if (++lately_ < remembered) return;
    least_ = std::exchange(least_lately_, longest_latency);
    lately_ = 0;
    known_ = true;
  }

 private:
  Duration least_ = longest_latency;
  Duration least_lately_ = longest_latency;  ///< of the last `lately_` waits
  int lately_ = 0;
  bool known_ = false;
};

}  // namespace axisd::modbus_rtu
