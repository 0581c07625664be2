#include "devices/yako_rtu/mode_watch.hpp"

#include <utility>

namespace axisd::yako_rtu {

namespace {

/// A motor that rests longer than this does not home any more. How long it rests between the phases of homing
/// is not said.
constexpr auto longest_pause = std::chrono::milliseconds(150);

}  // namespace

DriveMode ModeWatch::judge(const DriveSample& sample) {
  const auto before = std::exchange(before_, sample);
  if (sample.moving) {
    const bool homing = sample.mode == DriveMode::homing;
    low_ = homing && (!sample.homed || (homes_ && low_));
    homes_ = homing;
    resting_since_.reset();
    return sample.mode;
  }
  if (sample.mode != DriveMode::homing) {
    homes_ = false;
    return DriveMode::positioning;
  }
  const bool begins = !before || before->mode != DriveMode::homing || (before->homed && !sample.homed);
  if (begins && !homes_) {
    homes_ = true;
    low_ = before && !before->homed;
    resting_since_.reset();
  }
  if (!homes_) return DriveMode::positioning;
  low_ = low_ || !sample.homed;
  if (!resting_since_) resting_since_ = sample.asked_at;
  const bool done = low_ && sample.homed;
  if (done || sample.asked_at - *resting_since_ >= longest_pause) homes_ = false;
  return homes_ ? DriveMode::homing : DriveMode::positioning;
}

}  // namespace axisd::yako_rtu
