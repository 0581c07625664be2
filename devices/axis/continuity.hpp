// When was it last proven that the drive has not been restarted, and when is that to be proven next (M7)?
#pragma once

#include <cstdint>

#include "buses/clock.hpp"

namespace axisd {

/// The age of the last proof, and what follows from it. Pure. Thread: core.
///
///   fresh -- 800 ms -------------------> due: it is read beside the next reading
///   due -- 2 s ------------------------> forgotten: a reading means nothing before the next proof
///   forgotten -- 2.5 s ----------------> lost: the drive is offline
///   due, forgotten, lost -- proven() --> fresh
class Continuity {
 public:
  enum class State : std::uint8_t { fresh, due, forgotten, lost };

  /// A proof that was asked for then, or answered, succeeded.
  void proven(TimePoint at);
  /// A reading that the bus repeats waited for the line so long.
  void waited(Duration time);
  /// Nobody measures that wait while the bus repeats nothing.
  void forget_waits() { waited_ = waited_ * 3 / 4; }

  [[nodiscard]] State state(TimePoint now) const;
  /// A reading that was asked for then is too far from the last proof to mean anything by itself.
  [[nodiscard]] bool forgotten(TimePoint asked_at) const;
  /// It has been unproven for as long as it may.
  [[nodiscard]] bool lost(TimePoint now) const { return state(now) == State::lost; }
  /// Just proven: what takes long can be read now, without keeping the next proof waiting.
  [[nodiscard]] bool just_proven(TimePoint now) const;

  /// What of the axis decides about the time.
  enum class Pace : std::uint8_t {
    at_rest,
    moving,
    awaiting_end,  ///< of a motion: the canary waits as long as it may
  };
  /// The poll loop has to prove it now. `asked`: when it should have been, beside a reading by the bus.
  [[nodiscard]] bool is_due(TimePoint now, Pace pace, TimePoint asked) const;
  /// The poll loop proves it by then.
  [[nodiscard]] TimePoint latest(bool moving) const;
  /// When the bus proves it that repeats the reading, the next one being asked for then: with the last one
  /// that is in time, or between two where they are rare. Later than that one: not yet.
  [[nodiscard]] TimePoint due_beside(TimePoint next_reading, Duration period) const;
  /// When somebody has to look whether it is lost, on a grid that all axes share as long as it is not near.
  [[nodiscard]] TimePoint next_look(TimePoint now) const;

 private:
  [[nodiscard]] TimePoint latest_at_rest() const;

  TimePoint checked_{};
  Duration waited_{};  ///< for the line, the longest of the last of what the bus repeats
};

}  // namespace axisd
