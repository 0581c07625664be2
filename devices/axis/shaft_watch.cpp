#include "devices/axis/shaft_watch.hpp"

#include <algorithm>
#include <cstdlib>

namespace axisd {

void ShaftWatch::look(const DriveSample& now, const Facts& facts) {
  if (now.moving) positive_ = now.negative_direction == facts.inverted;
  if (rezeroing_ || facts.ours) ours_until_ = now.asked_at + facts.settling;
}

bool ShaftWatch::shows_loss(const std::optional<DriveSample>& before, const DriveSample& now,
                            const Facts& facts) const {
  if (facts.homes) return false;
  // So does homing that came and went between two samples. Where a drive zeroes its counter by homing on the
  // spot, that is ours.
  const bool homed_by_others = !rezeroing_ && before && !before->homed && now.homed;
  if (now.mode == DriveMode::homing || homed_by_others) return true;
  return now.moving && !facts.closed_loop && limit(facts, positive_);
}

bool ShaftWatch::hides_loss(const DriveSample& before, const DriveSample& now, std::int64_t turned_by,
                            const Facts& facts) const {
  return ended_abruptly(before, now, turned_by, facts) || homed_unseen(before, now, turned_by, facts);
}

/// Open loop: a limit and a quick stop end a motion without a ramp, and it may lose steps. What a terminal
/// started may have begun and ended between two readings.
bool ShaftWatch::ended_abruptly(const DriveSample& before, const DriveSample& now, std::int64_t turned_by,
                                const Facts& facts) const {
  if (facts.closed_loop || now.moving || !(before.moving || turned_by != 0)) return false;
  if (before.mode == DriveMode::homing || now.mode == DriveMode::homing) return false;
  const bool positive = before.moving ? positive_ : (turned_by > 0) != facts.inverted;
  return limit(facts, positive) || facts.quick_stop;
}

/// Homing that a terminal started may have begun and ended between two readings, and left neither its mode
/// nor a new homed bit: the counter tells of it where nothing of ours can have turned the shaft.
bool ShaftWatch::homed_unseen(const DriveSample& before, const DriveSample& now, std::int64_t turned_by,
                              const Facts& facts) const {
  if (now.asked_at <= ours_until_ || !facts.homing_terminal || before.moving || now.moving) return false;
  // A shaft that is released and turned is counted as such.
  const bool held = now.enabled || (before.enabled && !facts.counts_released);
  return held && std::abs(turned_by) > std::max(2 * facts.window, facts.noise);
}

void ShaftWatch::lose_sight(std::vector<std::int64_t> ends) {
  state_ = State::unseen;
  ends_ = std::move(ends);
}

bool ShaftWatch::undisturbed_at(std::int64_t counter) const {
  return state_ == State::seen || std::ranges::find(ends_, counter) != ends_.end();
}

}  // namespace axisd
