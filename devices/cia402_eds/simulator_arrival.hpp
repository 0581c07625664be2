// Where a motion of the simulated standard drive has ended: at its target, or at a limit of its own.
#pragma once

#include <optional>

#include "buses/clock.hpp"
#include "devices/cia402_eds/simulator_rates.hpp"
#include "devices/simulation/shaft.hpp"

namespace axisd::cia402_eds {

class Arrival {
 public:
  /// Both must outlive it.
  Arrival(const MotionObjects& objects, const simulation::Shaft& shaft)
      : objects_(&objects), shaft_(&shaft) {}

  /// A motion begins. `limited`: the software limit shortens it.
  void begin(bool limited);
  /// It has ended where it was to end.
  void arrive(TimePoint now);
  void end_at_limit() { limited_ = true; }
  void forget_limit() { limited_ = false; }
  void forget() { reached_ = limited_ = false; }

  /// A software limit shortened the last motion.
  [[nodiscard]] bool limited() const { return limited_; }
  /// 6067h counts from the end of the ramp on.
  void watch_window(TimePoint now);
  /// The encoder is within 6067h of the end of a motion, for 6068h already.
  [[nodiscard]] bool in_position(TimePoint now) const;
  /// When that may change with time alone; TimePoint::max(): it does not.
  [[nodiscard]] TimePoint next_event(TimePoint now) const;

 private:
  [[nodiscard]] Duration shortest_stay() const;

  const MotionObjects* objects_;
  const simulation::Shaft* shaft_;
  bool reached_ = false, limited_ = false;
  std::optional<TimePoint> in_window_since_;  ///< after a motion that ended at its target
};

}  // namespace axisd::cia402_eds
