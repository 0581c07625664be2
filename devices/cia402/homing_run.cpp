#include "devices/cia402/homing_run.hpp"

namespace axisd::cia402 {

void HomingRun::begin(TimePoint at, std::optional<std::int32_t> from) {
  leaving_ = false;
  ended_home_ = false;
  next_.from = from;
  watch_.begin(at, next_);
}

bool HomingRun::take(const DriveSample& sample, HomingWatch::Signs signs) {
  if (watch_.goes_on(sample, signs)) return true;
  ended_home_ = watch_.reached();
  leaving_ = true;
  return false;
}

void HomingRun::stop(bool found) {
  gate_->raise();
  leaving_ = leaving_ || watch_.active() || found;
  watch_.end();
}

MotionGuard HomingRun::go_back() {
  leaving_ = false;
  return {.gate = gate_, .epoch = gate_->epoch()};
}

void HomingRun::give_up() {
  gate_->raise();
  leaving_ = false;
}

void HomingRun::forget() {
  watch_.end();
  leaving_ = false;
  ended_home_.reset();
}

bool HomingRun::is_homed(bool told, bool bit_fell) {
  if (ended_home_ == false && !watch_.active() && bit_fell) ended_home_.reset();
  return ended_home_.value_or(told);
}

HomingRun::State HomingRun::state() const {
  if (watch_.active()) return State::homing;
  return leaving_ ? State::leaving : State::idle;
}

}  // namespace axisd::cia402
