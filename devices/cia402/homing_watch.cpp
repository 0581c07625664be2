#include "devices/cia402/homing_watch.hpp"

#include <algorithm>
#include <cstdlib>

namespace axisd::cia402 {

namespace {

/// Motor and bit need not come to rest in the same cycle of the drive.
constexpr Duration bit_lag = std::chrono::milliseconds(50);

/// By how much a counter wavers that was set to 0 just now (M30).
constexpr std::int64_t widest_in_place = 10;

bool within(std::int64_t position, std::int64_t other, std::int64_t tolerance) {
  return std::abs(position - other) <= tolerance;
}

}  // namespace

void HomingWatch::begin(TimePoint at, Start start) {
  *this = {};
  began_ = at;
  start_ = start;
  if (start.in_place) {
    // Nothing brakes, and a counter that is only near 0 is that of a start which the drive ignored.
    start_.braking = 0;
    start_.window = std::min(start.window, widest_in_place);
  }
  was_low_ = start.was_low;
  moved_ = start.in_place;
}

/// Which of the three it is after an offset is not said (6.2.6; CiA 402 has had both signs).
bool HomingWatch::at_home(std::int32_t position, std::int64_t tolerance) const {
  const std::int64_t offset = start_.offset;
  return within(position, 0, tolerance) || within(position, offset, tolerance) ||
         within(position, -offset, tolerance);
}

bool HomingWatch::near(std::int32_t position, std::int32_t other) const {
  return within(position, other, start_.window);
}

bool HomingWatch::goes_on(const DriveSample& sample, Signs signs) {
  if (!began_) return false;
  if (sample.asked_at < *began_) return true;
  if (!start_.from) start_.from = sample.position_pulses;
  held_up_ = held_up_ || signs.held_up;
  moved_ = moved_ || sample.moving || !near(sample.position_pulses, *start_.from);
  if (sample.moving) {
    rests_ = false;
  } else if (!rests_ || !near(sample.position_pulses, resting_at_)) {
    rests_ = true;
    resting_since_ = sample.asked_at;
    resting_at_ = sample.position_pulses;
  }
  const auto rest = rests_ ? sample.asked_at - resting_since_ : Duration{};
  was_low_ = was_low_ || (signs.low && (!start_.tied_to_rest || rest >= bit_lag));
  const bool placed = at_home(sample.position_pulses, start_.window);
  const bool close = at_home(sample.position_pulses, start_.window + start_.braking);
  const bool ended = rests_ && rest >= longest_rest;
  // Elsewhere the bit may have fallen only because the motor turned, and rest is only a pause.
  const bool believable = sample.homed && !held_up_ && (was_low_ || (moved_ && close));
  const bool home = rests_ && believable && (ended || (placed && was_low_));
  // What it says of an earlier one is gone as soon as this one has begun.
  const bool failed = signs.failed && rests_ && rest >= bit_lag;
  if (!home && !ended && !failed && sample.enabled) return true;
  began_.reset();
  reached_ = home;
  return false;
}

}  // namespace axisd::cia402
