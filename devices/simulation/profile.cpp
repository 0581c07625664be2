#include "devices/simulation/profile.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace axisd::simulation {

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
/// A jump of the speed: within a microsecond, less than a pulse.
constexpr double jump = 1e12;

double rate(double from, double to, double milliseconds) {
  return to > from && milliseconds > 0 ? (to - from) * 1000.0 / milliseconds : jump;
}

}  // namespace

Rates rates_from(double start_rpm, double cruise_rpm, double acceleration_ms, double deceleration_ms,
                 double pulses_per_revolution) {
  const double scale = pulses_per_revolution / 60.0;
  const double cruise = cruise_rpm * scale;
  const double start = std::min(start_rpm * scale, cruise);
  return {.start = start,
          .cruise = cruise,
          .acceleration = rate(start, cruise, acceleration_ms),
          .deceleration = rate(start, cruise, deceleration_ms)};
}

void Profile::add(double duration, double speed, double acceleration) {
  if (duration <= 0) return;
  ramps_.at(count_++) = {duration_, total_, duration, speed, acceleration};
  duration_ += duration;
  total_ += speed * duration + (acceleration == 0 ? 0 : acceleration * duration * duration / 2);
}

Profile Profile::move(double initial, const Rates& rates, double distance) {
  const double up = rates.acceleration, down = rates.deceleration;
  const double end = std::min(rates.start, rates.cruise);
  Profile profile;
  if (initial <= rates.cruise) {
    const double full = (rates.cruise * rates.cruise - initial * initial) / (2 * up) +
                        (rates.cruise * rates.cruise - end * end) / (2 * down);
    const double peak =
        full <= distance
            ? rates.cruise
            : std::sqrt((2 * up * down * distance + down * initial * initial + up * end * end) / (up + down));
    profile.add((peak - initial) / up, initial, up);
    profile.add(std::max(0.0, distance - full) / peak, peak, 0);
    profile.add((peak - end) / down, peak, -down);
  } else {
    const double full = (initial * initial - end * end) / (2 * down);
    profile.add((initial - rates.cruise) / down, initial, -down);
    profile.add(std::max(0.0, distance - full) / rates.cruise, rates.cruise, 0);
    profile.add((rates.cruise - end) / down, rates.cruise, -down);
  }
  profile.total_ = distance;  // the pulses are counted, so rounding never adds up
  return profile;
}

Profile Profile::run(double initial, const Rates& rates) {
  Profile profile;
  const double change = rates.cruise - initial;
  profile.add(std::abs(change) / rates.acceleration, initial,
              change > 0 ? rates.acceleration : -rates.acceleration);
  profile.add(infinite, rates.cruise, 0);
  return profile;
}

Profile Profile::halt(double initial, const Rates& rates) {
  Profile profile;
  profile.add((initial - rates.start) / rates.deceleration, initial, -rates.deceleration);
  return profile;
}

double Profile::stopping_distance(double initial, const Rates& rates) {
  const double end = std::min(initial, rates.start);
  return (initial * initial - end * end) / (2 * rates.deceleration);
}

const Profile::Ramp* Profile::ramp_at(double t) const {
  for (std::size_t i = 0; i < count_; ++i)
    if (t < ramps_[i].begin + ramps_[i].duration) return &ramps_[i];
  return nullptr;
}

double Profile::distance_at(double t) const {
  const auto* ramp = ramp_at(t);
  if (ramp == nullptr) return total_;
  const double dt = std::max(0.0, t - ramp->begin);
  return std::min(total_, ramp->distance + ramp->speed * dt + ramp->acceleration * dt * dt / 2);
}

double Profile::speed_at(double t) const {
  const auto* ramp = ramp_at(t);
  return ramp == nullptr ? 0 : ramp->speed + ramp->acceleration * std::max(0.0, t - ramp->begin);
}

double Profile::lag_after(double lag, double from, double to, double tau) const {
  for (std::size_t i = 0; i < count_; ++i) {
    const auto& ramp = ramps_.at(i);
    const double begin = std::max(from, ramp.begin), end = std::min(to, ramp.begin + ramp.duration);
    if (end <= begin) continue;
    // Behind a steady ramp it is by tau * speed - tau^2 * acceleration; what differs from that fades.
    const auto steady = [&](double t) {
      return tau * (ramp.speed + ramp.acceleration * (t - ramp.begin)) - tau * tau * ramp.acceleration;
    };
    lag = steady(end) + (lag - steady(begin)) * std::exp((begin - end) / tau);
  }
  const double rest = to - std::max(from, std::min(to, duration_));
  return rest > 0 ? lag * std::exp(-rest / tau) : lag;
}

double Profile::time_at(double distance) const {
  if (distance > total_) return infinite;
  for (std::size_t i = 0; i < count_; ++i) {
    const auto& ramp = ramps_[i];
    const double here = std::max(0.0, distance - ramp.distance);
    const double root = ramp.speed * ramp.speed + 2 * ramp.acceleration * here;
    if (root < 0) continue;  // this ramp brakes before it gets there
    const double dt = ramp.acceleration == 0 ? here / ramp.speed : 2 * here / (std::sqrt(root) + ramp.speed);
    if (dt <= ramp.duration) return ramp.begin + dt;
  }
  return duration_;
}

}  // namespace axisd::simulation
