#include "devices/simulation/motor.hpp"

#include <cmath>
#include <utility>

namespace axisd::simulation {

namespace {
/// A pulse counts when it is reached, whatever the last bit of the arithmetic says.
std::int64_t whole_pulses(double distance) { return static_cast<std::int64_t>(std::floor(distance + 1e-4)); }
}  // namespace

bool Motor::advance(TimePoint now, bool follows) {
  const auto from = std::exchange(now_, now);
  const auto before = commanded_;
  const bool ended = moving_ && now >= ends();
  if (moving_)
    commanded_ =
        from_ + direction_ * whole_pulses(ended ? profile_.total() : profile_.distance_at(elapsed()));
  if (blocked_)
    lag_ += commanded_ - before;
  else if (follows) {
    behind_ += static_cast<double>(lag_);
    lag_ = 0;
  }
  fall_behind(from);
  if (ended) moving_ = false;
  return ended;
}

void Motor::fall_behind(TimePoint from) {
  if (following_ <= 0) {
    behind_ = 0;
    return;
  }
  if (!moving_ && std::abs(behind_) < 1e-3) {
    behind_ = 0;  // of a shaft that follows within microseconds what is left would be a speed
    return;
  }
  if (moving_ && !blocked_)
    behind_ = direction_ * profile_.lag_after(behind_ * direction_,
                                              std::chrono::duration<double>(from - begin_).count(), elapsed(),
                                              following_);
  else
    behind_ *= std::exp(-std::chrono::duration<double>(now_ - from).count() / following_);
}

void Motor::power_up() {
  commanded_ = shaft();
  lag_ = 0;
  behind_ = 0;
  clear_counter();
}

void Motor::push(std::int64_t pulses, bool seen) {
  if (blocked_) return;
  commanded_ += pulses;
  if (!seen) offset_ -= pulses;
}

void Motor::begin(int direction, const Profile& profile, const Rates& rates) {
  direction_ = direction;
  profile_ = profile;
  rates_ = rates;
  begin_ = now_;
  from_ = commanded_;
  moving_ = true;
  braking_ = false;
}

Rates Motor::really(const Rates& told) const {
  return {.start = told.start * factor_,
          .cruise = told.cruise * factor_,
          .acceleration = told.acceleration * factor_,
          .deceleration = told.deceleration * factor_};
}

void Motor::move(std::int64_t distance, const Rates& told) {
  const auto rates = really(told);
  begin(distance < 0 ? -1 : 1,
        Profile::move(moving_ ? speed() : rates.start, rates, static_cast<double>(std::llabs(distance))),
        rates);
}

void Motor::run(int direction, const Rates& told) {
  const auto rates = really(told);
  begin(direction, Profile::run(moving_ ? speed() : rates.start, rates), rates);
}

void Motor::brake() { halt(rates_); }

void Motor::brake(double deceleration) {
  auto rates = rates_;
  rates.deceleration = deceleration * factor_;
  halt(rates);
}

void Motor::halt(const Rates& rates) {
  if (!moving_) return;
  begin(direction_, Profile::halt(speed(), rates), rates);
  braking_ = true;
}

void Motor::stop(bool slips) {
  if (!moving_) return;
  if (slips && !blocked_) lag_ -= direction_ * whole_pulses(speed() * 0.01);
  moving_ = false;
}

double Motor::speed() const { return moving_ ? profile_.speed_at(elapsed()) : 0; }

double Motor::shaft_speed() const {
  if (blocked_) return 0;
  return following_ > 0 ? behind_ / following_ : direction_ * speed();
}

bool Motor::cruising() const {
  return moving_ && !braking_ && std::abs(speed() - rates_.cruise) <= rates_.cruise * 1e-9;
}

double Motor::stopping_distance(const Rates& told) const {
  return moving_ ? Profile::stopping_distance(speed(), really(told)) : 0;
}

double Motor::elapsed() const { return std::chrono::duration<double>(now_ - begin_).count(); }

TimePoint Motor::after(double seconds) const {
  if (!(seconds < 1e9)) return TimePoint::max();
  return begin_ + Duration(static_cast<std::int64_t>(std::ceil(seconds * 1e9)));
}

TimePoint Motor::ends() const { return moving_ ? after(profile_.duration()) : TimePoint::max(); }

TimePoint Motor::commands(std::int64_t position) const {
  if (!moving_) return TimePoint::max();
  return after(profile_.time_at(static_cast<double>((position - from_) * direction_)));
}

TimePoint Motor::reaches(std::int64_t shaft) const {
  return blocked_ ? TimePoint::max() : commands(shaft + lag_);
}

TimePoint Motor::lags(std::int64_t lag) const {
  return blocked_ ? commands(shaft() + direction_ * lag) : TimePoint::max();
}

}  // namespace axisd::simulation
