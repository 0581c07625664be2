#include "devices/cia402/standstill.hpp"

#include <algorithm>
#include <chrono>
#include <cstdlib>

namespace axisd::cia402 {

namespace {

/// In which a motion of 1 r/min leaves the band for certain, readings being off by up to the band themselves.
Duration time_of(std::int64_t band, std::int64_t pulses_per_revolution) {
  using std::chrono::milliseconds;
  constexpr std::int64_t minute = 60'000;
  const auto time = milliseconds(2 * band * minute / std::max<std::int64_t>(pulses_per_revolution, 1));
  return std::clamp(time, milliseconds(20), milliseconds(1000));
}

/// Up to so many times its noise a velocity may be the last of a settling, for so many readings in a row.
constexpr int settling_factor = 3, settling_readings = 5;

/// How far readings of a shaft that rests are apart at most.
std::int64_t band_of(const Standstill::Gauge& gauge) {
  return gauge.window > 0 ? std::max<std::int64_t>(gauge.window / 2, 1) : 0;
}

}  // namespace

bool Standstill::settles(const Look& look, const Gauge& gauge) const {
  const auto& rest = doubted_ ? rested_ : since_;
  const bool rests = rest && (doubted_ || !moves_) && look.told == false;
  return rests && std::abs(look.velocity_rpm) <= settling_factor * gauge.noise_rpm &&
         unsettled_ < settling_readings &&
         std::abs(way_between(rest->position, look.position)) <= band_of(gauge);
}

bool Standstill::moves(const Look& look, const Gauge& gauge) {
  const auto speed = std::abs(look.velocity_rpm);
  if (speed > gauge.noise_rpm) {
    if (!settles(look, gauge)) return note(look, true);
    ++unsettled_;
    return moves_;
  }
  if (look.told && (*look.told || speed <= velocity_noise_rpm)) return note(look, *look.told);
  if (!since_) {
    const bool doubted = doubted_;
    const auto rested = rested_;
    note(look, moves_);
    doubted_ = doubted;
    rested_ = rested;
    return moves_;
  }
  const auto band = band_of(gauge);
  if (std::abs(way_between(since_->position, look.position)) > band) return note(look, true);
  const auto proof = time_of(std::max<std::int64_t>(band, 1), gauge.pulses_per_revolution);
  if (moves_ && look.at - since_->at >= proof) return note(look, false);
  unsettled_ = 0;
  return moves_;
}

bool Standstill::note(const Look& look, bool moves) {
  since_ = look;
  rested_.reset();
  unsettled_ = 0;
  doubted_ = false;
  return moves_ = moves;
}

}  // namespace axisd::cia402
