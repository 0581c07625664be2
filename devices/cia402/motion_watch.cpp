#include "devices/cia402/motion_watch.hpp"

#include <cstdlib>

namespace axisd::cia402 {

void MotionWatch::begin(TimePoint at) {
  state_ = State::begun;
  since_ = at;
}

void MotionWatch::stop(bool may_run) {
  if (state_ != State::rest || may_run) standstill_.doubt();
  state_ = State::rest;
}

void MotionWatch::counter_jumped() {
  standstill_.forget();
  direction_from_.reset();
}

void MotionWatch::forget() {
  counter_jumped();
  state_ = State::rest;
  position_.reset();
  moves_ = false;
}

void MotionWatch::take(DriveSample& sample, const Means& means) {
  if (means.by_way) {
    sample.moving = standstill_.moves({.at = sample.asked_at,
                                       .position = sample.position_pulses,
                                       .velocity_rpm = sample.velocity_rpm,
                                       .told = means.told},
                                      means.gauge);
    if (!sample.moving || standstill_.doubted()) sample.velocity_rpm = 0;
  }
  note_direction(sample, means.gauge.window);
  sample.negative_direction = negative_;
  position_ = sample.position_pulses;
  moves_ = sample.moving;
  note_state(sample);
}

void MotionWatch::note_direction(const DriveSample& sample, std::int64_t window) {
  if (!direction_from_) direction_from_ = sample.position_pulses;
  const auto way = std::int64_t{sample.position_pulses} - *direction_from_;
  if (std::abs(way) > window / 2) {
    negative_ = way < 0;
    direction_from_ = sample.position_pulses;
  } else if (sample.velocity_rpm != 0) {
    negative_ = sample.negative_direction;
  }
}

void MotionWatch::note_state(const DriveSample& sample) {
  if (state_ == State::rest || sample.asked_at < since_) return;
  if (sample.moving)
    state_ = State::seen;
  else if (state_ == State::seen || sample.asked_at - since_ >= start_window)
    state_ = State::rest;
}

}  // namespace axisd::cia402
