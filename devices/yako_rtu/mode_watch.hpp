// What the mode register (0x0003) means, sample after sample.
#pragma once

#include <optional>

#include "devices/drive.hpp"

namespace axisd::yako_rtu {

/// The manuals leave open whether 0x0003 falls back to 0 when homing, PT or PV has ended, or keeps what was
/// started last. So at rest it proves nothing, but for this: within homing the motor rests between its phases
/// and goes on. Pure. Thread: core.
class ModeWatch {
 public:
  /// What the drive is doing; `sample` holds the mode as the register has it. In the order of the samples;
  /// the same one again changes nothing.
  DriveMode judge(const DriveSample& sample);

 private:
  std::optional<DriveSample> before_;
  bool homes_ = false;  ///< homing was seen to begin, or to run, and not to end
  bool low_ = false;    ///< the homed bit was, since then
  std::optional<TimePoint> resting_since_;
};

}  // namespace axisd::yako_rtu
