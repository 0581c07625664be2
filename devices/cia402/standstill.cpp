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

}  // namespace

bool Standstill::moves(const Look& look, const Gauge& gauge) {
  if (std::abs(look.velocity_rpm) > velocity_noise_rpm) return note(look, true);
  if (look.told) return note(look, *look.told);
  if (!since_) return note(look, moves_);
  const auto least = std::max<std::int64_t>(gauge.window / 2, 1);
  const auto band = gauge.window > 0 ? least : 0;
  if (std::abs(way_between(since_->position, look.position)) > band) return note(look, true);
  if (moves_ && look.at - since_->at >= time_of(least, gauge.pulses_per_revolution)) return note(look, false);
  return moves_;
}

bool Standstill::note(const Look& look, bool moves) {
  since_ = look;
  return moves_ = moves;
}

}  // namespace axisd::cia402
