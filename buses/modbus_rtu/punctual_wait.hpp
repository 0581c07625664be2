#pragma once

#include <optional>

#include "buses/clock.hpp"
#include "buses/modbus_rtu/wake_latency.hpp"

namespace axisd::modbus_rtu {

/// A wait for the moment from which on something may begin, with work between waking and beginning: it is
/// woken so much sooner as both usually take. Never ends too soon. Thread: the line's worker.
class PunctualWait {
 public:
  /// Blocks until shortly before `when`.
  void begin(TimePoint when);
  /// Passes what is left without sleeping, which is shorter than to sleep would take, or less of it once
  /// `enough()`, which is asked again and again. Returns the time then.
  template <class Enough>
  TimePoint finish(Enough enough) {
    auto now = woken();
    while (now < when_ && !enough()) now = monotonic_now();
    return now;
  }
  TimePoint finish() {
    return finish([] { return false; });
  }
  /// `when` does not matter any more.
  void abandon() { when_ = {}; }

 private:
  TimePoint woken();

  TimePoint when_{};
  std::optional<TimePoint> asked_;  ///< to be woken
  UsualLatency latency_;
};

}  // namespace axisd::modbus_rtu
