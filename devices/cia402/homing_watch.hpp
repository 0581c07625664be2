// Tells when a homing that was started has ended: 6061h stays at 6, so only the motion and the bits tell.
#pragma once

#include <optional>

#include "devices/drive.hpp"

namespace axisd::cia402 {

/// Pure.
///
///   idle --begin()--> homing --home reported after it had not been, at rest--> idle
///                     homing --at rest at one place for `longest_rest`, or released--> idle
class HomingWatch {
 public:
  /// Between its phases the motor rests for less than this.
  static constexpr Duration longest_rest = std::chrono::milliseconds(500);

  void begin(TimePoint at);
  void end() { began_.reset(); }
  /// Takes a sample, and says whether homing goes on.
  bool goes_on(const DriveSample& sample);
  [[nodiscard]] bool active() const { return began_.has_value(); }

 private:
  std::optional<TimePoint> began_;
  bool was_not_home_ = false;  ///< the bit may be left from the last time: only its rise counts
  TimePoint resting_since_{};
  std::int32_t resting_at_ = 0;
  bool rests_ = false;
};

}  // namespace axisd::cia402
