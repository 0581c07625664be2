#include "devices/axis/speed_watch.hpp"

#include <algorithm>
#include <cmath>

#include "buses/seconds.hpp"

namespace axisd {

namespace {

using std::chrono::milliseconds;

/// Slower than so many times the fastest velocity is never too fast.
constexpr double factor = 1.5;
/// Readings that follow sooner are left out: a drive counts in steps of its own cycle.
constexpr Duration spacing = milliseconds(15);
/// What a drive tells may be so old, or a time stamp so far off.
constexpr double staleness_s = 0.05;
/// Of a revolution: noise, play and whole counts.
constexpr double wavers = 1.0 / 8;
/// Of the margin: what confirms a doubt is no noise, either.
constexpr double confirmation = 1.0 / 4;
/// So long after a motion the shaft may still be coming to where it was told to stop.
constexpr Duration settles = milliseconds(500);

/// Right also where the counter has wrapped between the two.
double way(std::int32_t from, std::int32_t to) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(to) - static_cast<std::uint32_t>(from));
}

}  // namespace

double SpeedWatch::possible(Duration time) const {
  return factor * fastest_ * std::max(0.0, in_seconds(time));
}

double SpeedWatch::margin() const { return revolution_ * wavers + fastest_ * staleness_s; }

void SpeedWatch::note_motion(const Reading& reading) {
  if (reading.moving) moved_at_ = reading.asked_at;
}

void SpeedWatch::begin(const Reading& before, double fastest) {
  note_motion(before);
  state_ = State::following;
  fastest_ = fastest;
  start_ = last_ = before;
  behind_ = moved_at_ && before.asked_at < *moved_at_ + settles ? revolution_ : 0;
  ahead_.fill(-behind_);
}

void SpeedWatch::rest(const Reading& reading) {
  note_motion(reading);
  state_ = State::resting;
}

bool SpeedWatch::follow(const Reading& reading) {
  note_motion(reading);
  if (reading.asked_at < last_.asked_at + spacing) return false;
  if (state_ == State::following)
    look_for_doubt(reading);
  else if (state_ == State::doubted)
    return confirms(reading);
  return false;
}

/// The furthest that the shaft got ahead in any stretch that ends here. Within a stretch only the time from
/// its first request to its last reply is uncertain, so what the readings in between took does not add up.
void SpeedWatch::look_for_doubt(const Reading& reading) {
  const auto gone = way(last_.pulses, reading.pulses);
  const auto slack = possible(reading.measured_at - reading.asked_at) + margin();
  for (std::size_t i = 0; i < directions.size(); ++i) {
    ahead_[i] += (directions[i] * gone) - possible(reading.asked_at - last_.asked_at);
    ahead_[i] = std::max(ahead_[i], -revolution_);
    if (ahead_[i] <= slack) continue;
    state_ = State::doubted;
    doubted_direction_ = directions[i];
  }
  last_ = reading;
}

/// From the reading that raised the doubt on.
bool SpeedWatch::confirms(const Reading& reading) {
  const auto gone = doubted_direction_ * way(last_.pulses, reading.pulses);
  const auto longest = reading.measured_at - last_.asked_at;
  if (gone > possible(longest) + (confirmation * margin())) return find(gone, longest);
  if (gone > possible(reading.asked_at - last_.asked_at)) return false;  // too little to tell
  state_ = State::following;
  ahead_.fill(-revolution_);
  last_ = reading;
  return false;
}

bool SpeedWatch::arrive(const Reading& reading) {
  if (state_ != State::following && state_ != State::doubted) return false;
  const auto gone = std::abs(way(start_.pulses, reading.pulses));
  const auto longest = reading.measured_at - start_.asked_at;
  return gone > possible(longest) + margin() + behind_ && find(gone, longest);
}

bool SpeedWatch::find(double gone, Duration time) {
  state_ = State::too_fast;
  seen_ = gone / std::max(in_seconds(time), 1e-3);
  return true;
}

}  // namespace axisd
