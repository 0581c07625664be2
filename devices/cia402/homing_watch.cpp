#include "devices/cia402/homing_watch.hpp"

#include <cstdlib>

namespace axisd::cia402 {

void HomingWatch::begin(TimePoint at) {
  *this = {};
  began_ = at;
}

bool HomingWatch::goes_on(const DriveSample& sample) {
  constexpr std::int64_t jitter = 2;  // pulses; an encoder at rest
  if (!began_) return false;
  if (sample.asked_at < *began_) return true;
  if (!sample.homed) was_not_home_ = true;
  const auto away = std::int64_t{sample.position_pulses} - resting_at_;
  if (sample.moving) {
    rests_ = false;
  } else if (!rests_ || std::abs(away) > jitter) {
    rests_ = true;
    resting_since_ = sample.asked_at;
    resting_at_ = sample.position_pulses;
  }
  const bool home = rests_ && sample.homed && was_not_home_;
  const bool gave_up = rests_ && sample.asked_at - resting_since_ >= longest_rest;
  if (home || gave_up || !sample.enabled) began_.reset();
  return active();
}

}  // namespace axisd::cia402
