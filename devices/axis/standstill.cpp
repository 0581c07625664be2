#include "devices/axis/standstill.hpp"

#include <cstdlib>

namespace axisd {

RestVerdict StandstillWatch::look(const DriveSample& sample, std::int64_t counter, std::int64_t window) {
  if (sample.asked_at < since_) return RestVerdict::undecided;
  const bool settled = resting_since_ && std::abs(counter - resting_at_) <= window;
  const bool rested = settled && sample.asked_at - *resting_since_ >= rest;
  if (!sample.moving && (sample.mode != DriveMode::homing || rested)) return RestVerdict::rests;
  if (sample.moving) {
    resting_since_.reset();
  } else if (!settled) {
    resting_since_ = sample.asked_at;
    resting_at_ = counter;
  }
  const bool over = sample.asked_at >= deadline_ + (resting_since_ ? rest : Duration{0});
  return over ? RestVerdict::moves : RestVerdict::undecided;
}

RestVerdict UnpolledStandstill::look(const DriveSample& sample, std::int64_t counter, std::int64_t window) {
  silent_ = 0;
  const bool rests = !sample.moving && (resting_ == 0 || std::abs(counter - resting_at_) <= window);
  if (resting_ == 0) resting_at_ = counter;
  resting_ = rests ? resting_ + 1 : 0;
  if (resting_ > 0 && sample.mode != DriveMode::homing) return RestVerdict::rests;
  if (resting_ >= resting_in_homing) return RestVerdict::rests;
  if (sample.asked_at >= deadline_ && resting_ == 0) return RestVerdict::moves;
  return RestVerdict::undecided;
}

RestVerdict UnpolledStandstill::silence() {
  return ++silent_ == longest_silence ? RestVerdict::moves : RestVerdict::undecided;
}

}  // namespace axisd
