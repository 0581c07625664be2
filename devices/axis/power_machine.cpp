#include "devices/axis/power_machine.hpp"

namespace axisd {

bool PowerMachine::released(bool enabled_before) {
  const bool ours = state_ == State::ours;
  if (ours) state_ = State::found;
  return ours || enabled_before;
}

bool PowerMachine::look(const DriveSample& sample) {
  if (!release_since_) return false;
  if (!sample.enabled && sample.asked_at >= *release_since_) release_since_.reset();
  return sample.enabled;
}

EnableMachine::State EnableMachine::look(const DriveSample& sample, bool elsewhere, TimePoint now) {
  if (!goes_on()) return state_;
  if (sample.moving || elsewhere) return state_ = State::turned;
  if (sample.enabled && state_ == State::waiting) {
    state_ = State::opening;
    open_ = now + brake_;
    deadline_ = open_ + shows_within;
  }
  if (sample.enabled && now >= open_) return state_ = State::on;
  if (now >= deadline_) state_ = State::not_shown;
  return state_;
}

}  // namespace axisd
