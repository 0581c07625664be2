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
  /// Passes what is left without sleeping, which is shorter than to sleep would take. Returns the time then.
  TimePoint finish();
  /// `when` does not matter any more.
  void abandon() { when_ = {}; }

 private:
  TimePoint when_{};
  std::optional<TimePoint> asked_;  ///< to be woken
  UsualLatency latency_;
};

}  // namespace axisd::modbus_rtu
