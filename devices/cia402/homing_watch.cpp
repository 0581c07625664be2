#include "devices/cia402/homing_watch.hpp"

#include <cstdlib>

namespace axisd::cia402 {

namespace {

constexpr std::int64_t jitter = 2;  // pulses; an encoder at rest

bool near(std::int64_t position, std::int64_t other) { return std::abs(position - other) <= jitter; }

}  // namespace

void HomingWatch::begin(TimePoint at, std::optional<std::int32_t> from, std::int32_t offset) {
  *this = {};
  began_ = at;
  from_ = from;
  offset_ = offset;
}

/// Which of the three it is after an offset is not said (6.2.6; CiA 402 has had both signs).
bool HomingWatch::at_home(std::int32_t position) const {
  return near(position, 0) || near(position, offset_) || near(position, -offset_);
}

bool HomingWatch::goes_on(const DriveSample& sample, Signs signs) {
  if (!began_) return false;
  if (sample.asked_at < *began_) return true;
  if (!from_) from_ = sample.position_pulses;
  was_low_ = was_low_ || signs.low;
  held_up_ = held_up_ || signs.held_up;
  moved_ = moved_ || sample.moving || !near(sample.position_pulses, *from_);
  if (sample.moving) {
    rests_ = false;
  } else if (!rests_ || !near(sample.position_pulses, resting_at_)) {
    rests_ = true;
    resting_since_ = sample.asked_at;
    resting_at_ = sample.position_pulses;
  }
  const bool placed = at_home(sample.position_pulses);
  const bool ended = rests_ && sample.asked_at - resting_since_ >= longest_rest;
  // Elsewhere the bit may have fallen only because the motor turned, and rest is only a pause.
  const bool believable = sample.homed && !held_up_ && (was_low_ || (moved_ && placed));
  const bool home = rests_ && believable && (ended || (placed && was_low_));
  if (!home && !ended && sample.enabled) return true;
  began_.reset();
  reached_ = home;
  return false;
}

}  // namespace axisd::cia402
