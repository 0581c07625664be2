#pragma once

#include <algorithm>
#include <utility>

#include "buses/clock.hpp"

namespace axisd::modbus_rtu {

/// How late the timed waits of a thread end, at the least: so much sooner it may ask to be woken, and be on
/// time. Keeps to the least of the last waits. Pure.
class WakeLatency {
 public:
  /// Waits after which a machine that has become slower is taken for that.
  static constexpr int remembered = 64;
  /// One that is later than this is not relied upon: whoever is woken too soon passes the rest of the time
  /// without sleeping.
  static constexpr Duration most = std::chrono::microseconds(100);
  /// Of how late a wait for bytes has ended, no more than this is relied upon: it shortens a silence. Should
  /// it be wrong, that is 0.3 % of the 1.75 ms, where a receiver bears 2 % in the bit rate (Modbus over
  /// serial line 3.2).
  static constexpr Duration surely = std::chrono::microseconds(5);

  /// What to ask for in place of `when`.
  [[nodiscard]] TimePoint asked_for(TimePoint when) const {
    return when - (known_ ? least_ : Duration::zero());
  }

  /// When that has come at the latest for which a thread waited from `looked` on, and which it saw at `seen`:
  /// to be woken by it took no less time than to be woken by a clock.
  [[nodiscard]] TimePoint came_by(TimePoint looked, TimePoint seen) const {
    const auto late = known_ ? std::min(least_, surely) : Duration::zero();
    return seen - looked > late ? seen - late : seen;  // else it did not sleep
  }

  /// A wait that was to end at `asked` ended at `woken`.
  void note(TimePoint asked, TimePoint woken) {
    const auto late = std::clamp(woken - asked, Duration::zero(), most);
    least_ = std::min(least_, late);
    least_lately_ = std::min(least_lately_, late);
    if (++lately_ < remembered) return;
    least_ = std::exchange(least_lately_, most);
    lately_ = 0;
    known_ = true;
  }

 private:
  Duration least_ = most;
  Duration least_lately_ = most;  ///< of the last `lately_` waits
  int lately_ = 0;
  bool known_ = false;
};

}  // namespace axisd::modbus_rtu
