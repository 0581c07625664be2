#include "devices/axis/continuity.hpp"

#include <algorithm>

#include "devices/axis/settings.hpp"

namespace axisd {

namespace {

constexpr auto continuity_latest = milliseconds(950);
/// M7.
constexpr auto continuity_every = milliseconds(1000);
/// At rest nothing is lost where it is asked for in good time: something else may need the line just then.
constexpr auto continuity_latest_at_rest = milliseconds(850);
/// Sooner it is not asked for, however well it would fit between two readings.
constexpr auto continuity_soonest = milliseconds(700);
/// However long others have kept the line.
constexpr auto continuity_soonest_of_all = milliseconds(200);
/// So long after its reply, at most, a bus tells of a reading that it repeats: others are carried out behind
/// it, and the last of them may have no answer.
constexpr auto told_late = milliseconds(140);
/// So long a drive may fail to prove that it was not restarted. What it tells of its position is shown as
/// trusted meanwhile.
constexpr auto continuity_longest = milliseconds(2500);
/// How soon the watch looks again at an axis that is beyond it, but is being asked.
constexpr auto continuity_look = milliseconds(50);
/// At multiples of this the watch looks at all axes whose time is not near: they wake the core together.
constexpr Duration continuity_grid = milliseconds(500);

}  // namespace

void Continuity::proven(TimePoint at) { checked_ = std::max(checked_, at); }

/// A canary waits less, a reading behind others' longer.
void Continuity::waited(Duration time) { waited_ = std::max(time, waited_ * 3 / 4); }

Continuity::State Continuity::state(TimePoint now) const {
  const auto age = now - checked_;
  if (age >= continuity_longest) return State::lost;
  if (age > continuity_forgotten) return State::forgotten;
  return age >= continuity_period ? State::due : State::fresh;
}

bool Continuity::forgotten(TimePoint asked_at) const { return state(asked_at) >= State::forgotten; }

bool Continuity::just_proven(TimePoint now) const { return now - checked_ < continuity_period / 2; }

bool Continuity::is_due(TimePoint now, Pace pace, TimePoint asked) const {
  const bool asked_in_vain = pace != Pace::awaiting_end && now >= asked && checked_ < asked;
  const bool late = pace == Pace::at_rest && now >= latest_at_rest();
  const Duration period = pace == Pace::awaiting_end ? Duration(continuity_latest) : continuity_period;
  return asked_in_vain || late || now - checked_ >= period;
}

TimePoint Continuity::latest(bool moving) const {
  return moving ? checked_ + continuity_latest : latest_at_rest();
}

/// So that M7 holds though a reading goes first that waits for the line: twice as long as others did where
/// all axes ask for their canaries just then, and the canary behind those.
TimePoint Continuity::latest_at_rest() const {
  return checked_ + std::clamp<Duration>(continuity_every - told_late - 3 * waited_,
                                         continuity_soonest_of_all, continuity_latest_at_rest);
}

TimePoint Continuity::due_beside(TimePoint next_reading, Duration period) const {
  const auto latest = latest_at_rest();
  if (next_reading > latest) return latest;
  const bool last_in_time = next_reading + period > latest;
  return last_in_time && next_reading >= checked_ + continuity_soonest ? next_reading : TimePoint::max();
}

TimePoint Continuity::next_look(TimePoint now) const {
  const auto limit = checked_ + continuity_longest;
  const auto on_grid = limit - limit.time_since_epoch() % continuity_grid;
  return on_grid > now ? on_grid : std::max(limit, now + continuity_look);
}

}  // namespace axisd
