#include "devices/axis/homing_machine.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "buses/seconds.hpp"
#include "devices/axis/motion_machine.hpp"

namespace axisd {

namespace {

/// Longest that a shaft takes to follow the drive to where it has stopped.
constexpr Duration home_settling = std::chrono::milliseconds(500);

}  // namespace

HomingMachine::HomingMachine(const Homing& homing, const Scale& scale)
    : homing_(homing),
      scale_(scale),
      bit_was_low_(!homing.homed_before),
      origin_(homing.origin),
      previous_(homing.origin),
      previous_asked_(homing.asked_at) {}

std::int64_t HomingMachine::near() const { return std::max<std::int64_t>(homing_.window, 1); }

HomingMachine::State HomingMachine::look(const Reading& reading, TimePoint now) {
  if (state_ > State::settling) return state_;
  const auto& sample = reading.sample;
  if (sample.asked_at >= homing_.since) {
    if (!sample.homed) bit_was_low_ = true;
    // The bit rose for this homing, however short it was.
    const bool risen = sample.homed && bit_was_low_;
    if (state_ == State::starting && (sample.mode == DriveMode::homing || risen)) state_ = State::searching;
    const bool ended = !sample.moving && sample.mode == DriveMode::positioning;
    if (state_ != State::starting && ended) return state_ = judge_rest(reading, now);
    if (state_ == State::settling) state_ = State::searching;
    if (goes_too_far(reading)) return state_ = State::too_far;
  }
  // Only who was asked after the window has not started: a silent drive may well run.
  if (state_ == State::starting && sample.asked_at >= homing_.since + start_window)
    return state_ = State::did_not_start;
  if (now >= latest()) state_ = State::took_too_long;
  return state_;
}

HomingMachine::State HomingMachine::judge_rest(const Reading& reading, TimePoint now) {
  const auto& sample = reading.sample;
  // Which of the two it is after a compensation is not said (7.5).
  const auto counter = std::int64_t{sample.position_pulses};
  const bool at_home = std::abs(counter) <= near() || std::abs(counter - homing_.offset_pulses) <= near();
  // The shaft follows late: what is measured first is still on the way there (M30).
  if (!rests_since_) rests_since_ = now;
  if (sample.homed && !at_home && homing_.window > 0 && now < *rests_since_ + home_settling)
    return State::settling;
  const bool rose = sample.homed && bit_was_low_;
  return rose || (sample.homed && at_home && !reading.held_up) ? State::home : State::not_reached;
}

/// The drive zeroes its counter at home: a step that the motor cannot make between two samples is no travel.
bool HomingMachine::goes_too_far(const Reading& reading) {
  const auto step = reading.counter - previous_;
  previous_ = reading.counter;
  const auto seconds = in_seconds(reading.sample.measured_at - previous_asked_);
  previous_asked_ = reading.sample.asked_at;
  if (std::abs(static_cast<double>(step)) > static_cast<double>(near()) + (1.1 * homing_.fastest * seconds))
    origin_ += step;
  const auto travel = std::abs(scale_.to_units(reading.counter) - scale_.to_units(origin_));
  return homing_.max_travel && travel > *homing_.max_travel;
}

}  // namespace axisd
