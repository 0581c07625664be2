// Does the axis rest after a stop? By readings alone.
#pragma once

#include <cstdint>
#include <optional>

#include "buses/clock.hpp"
#include "devices/drive.hpp"

namespace axisd {

/// What a reading says.
enum class RestVerdict : std::uint8_t { undecided, rests, moves };

/// Judges the readings of a drive that is polled. A reading counts if it was asked for at `since` or later.
/// Within homing the motor rests between the phases, so there it must have rested at one place for a while.
/// It moves on (RestVerdict::moves) only where a reading from after `deadline` shows that: on a slow line
/// that reading may come late, and a silent node goes offline. Pure. Thread: core.
///
///   moving  -- at rest, not within homing -----------> verdict: rests
///   moving  -- at rest within homing ----------------> resting
///   resting -- at the same place, for `rest` --------> verdict: rests
///   resting -- at rest elsewhere --------------------> resting, from then on
///   resting -- in motion ----------------------------> moving
///   moving  -- read after the deadline --------------> verdict: moves
///   resting -- read `rest` after the deadline -------> verdict: moves
class StandstillWatch {
 public:
  enum class State : std::uint8_t { moving, resting };
  /// So long it rests within homing before that is no pause between two phases.
  static constexpr Duration rest = std::chrono::milliseconds(150);

  StandstillWatch(TimePoint since, TimePoint deadline) : since_(since), deadline_(deadline) {}
  /// `counter`: where the reading has the shaft. `window`: pulses within which that wavers.
  [[nodiscard]] RestVerdict look(const DriveSample& sample, std::int64_t counter, std::int64_t window);
  [[nodiscard]] State state() const { return resting_since_ ? State::resting : State::moving; }

 private:
  TimePoint since_, deadline_;
  std::optional<TimePoint> resting_since_;  ///< set: resting
  std::int64_t resting_at_ = 0;
};

/// The same for a node that nobody polls: whoever uses this asks for each reading. Between the phases of
/// homing the motor rests for some readings. Pure. Thread: core.
///
///   moving  -- at rest, not within homing ---------> verdict: rests
///   moving  -- at rest within homing --------------> resting
///   resting -- at the same place, several times ---> verdict: rests
///   resting -- in motion, or at rest elsewhere ----> moving
///   moving  -- read after the deadline ------------> verdict: moves
///   any     -- no reply, several times in a row ---> verdict: moves, as far as is known
class UnpolledStandstill {
 public:
  static constexpr int resting_in_homing = 6;  ///< readings
  static constexpr int longest_silence = 3;    ///< readings

  explicit UnpolledStandstill(TimePoint deadline) : deadline_(deadline) {}
  [[nodiscard]] RestVerdict look(const DriveSample& sample, std::int64_t counter, std::int64_t window);
  [[nodiscard]] RestVerdict silence();

 private:
  TimePoint deadline_;
  int resting_ = 0;  ///< readings in a row; 0: moving
  int silent_ = 0;   ///< readings in a row
  std::int64_t resting_at_ = 0;
};

}  // namespace axisd
