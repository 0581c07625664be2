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
  /// A reading that the bus repeats has waited for the line for that time.
  void waited(Duration time);
  /// The waits count less: nobody measures them while the bus repeats nothing.
  void fade_waits() { waited_ = waited_ * 3 / 4; }

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
  /// The poll loop has to prove it now. `asked`: when the bus was told to prove it beside a reading, as
  /// due_beside() said; max(): it was not told to.
  [[nodiscard]] bool is_due(TimePoint now, Pace pace, TimePoint asked) const;
  /// The poll loop proves it by then.
  [[nodiscard]] TimePoint latest(bool moving) const;
  /// When the bus has to prove it. It repeats the reading every `period`, the next time at `next_reading`:
  /// with that one, if the one after it would be too late; before it, if it is too late itself; max(): not
  /// yet.
  [[nodiscard]] TimePoint due_beside(TimePoint next_reading, Duration period) const;
  /// When to look whether it is lost: at times that all axes share, and more exactly when it is about to be.
  [[nodiscard]] TimePoint next_look(TimePoint now) const;

 private:
  [[nodiscard]] TimePoint latest_at_rest() const;

  TimePoint checked_{};
  Duration waited_{};  ///< the longest that one of the last repeated readings has waited for the line
};

}  // namespace axisd
