// The power stage: who switched it on, what is owed of switching it off, and how an enable ends (M1, M2).
#pragma once

#include <cstdint>
#include <optional>

#include "buses/clock.hpp"
#include "devices/drive.hpp"

namespace axisd {

/// What is known of the power stage beside the drive's own bit. Pure. Thread: core.
///
///   any   -- enabled() -------------------------> ours
///   ours  -- released() ------------------------> found
///   any   -- restarted() -----------------------> restarted
///
/// `on_lease_loss: disable` (Release):
///
///   none -- owe_release() ----------------------> owed, from then on
///   owed -- a reading from then on, released ---> none
///   owed -- give_up() --------------------------> none
class PowerMachine {
 public:
  enum class State : std::uint8_t {
    found,  ///< whatever it is, no command of ours has made it so
    ours,   ///< a command of ours has enabled it
    /// The drive was restarted, and no command of ours has enabled it since: nothing starts, though it may
    /// have come up energised.
    restarted,
  };
  enum class Release : std::uint8_t { none, owed };

  void enabled() { state_ = State::ours; }
  /// A reading shows it off. True: a command had enabled it, or the reading before showed it on.
  bool released(bool enabled_before);
  void restarted() { state_ = State::restarted; }

  /// A reading that is asked for from `since` on shows whether it is done.
  void owe_release(TimePoint since) { release_since_ = since; }
  /// The newest reading. True: a release is owed, and not done.
  [[nodiscard]] bool look(const DriveSample& sample);
  void give_up() { release_since_.reset(); }

  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] bool enabled_by_us() const { return state_ == State::ours; }
  [[nodiscard]] Release release() const { return release_since_ ? Release::owed : Release::none; }
  [[nodiscard]] bool owes_release() const { return release_since_.has_value(); }

 private:
  State state_ = State::found;
  std::optional<TimePoint> release_since_;  ///< set: owed
};

/// Judges the readings after an enable that was, or may have been, executed. Power never moves (M23):
/// whatever turns the shaft meanwhile was not asked for. The drive opens its brake when it shows its power
/// stage as on; until that is open nothing else is accepted, and nothing may move. Pure. Thread: core.
///
///   waiting          -- shows it on ----------------------------> opening
///   waiting          -- not within a second --------------------> not_shown
///   opening          -- shows it on, and the brake is open -----> on
///   opening          -- not within a second of that time -------> not_shown
///   waiting, opening -- moves, or is elsewhere than before -----> turned
///   waiting, opening -- silent() -------------------------------> not_shown
class EnableMachine {
 public:
  enum class State : std::uint8_t { waiting, opening, on, turned, not_shown };
  static constexpr Duration shows_within = std::chrono::seconds(1);

  /// `now`: when it was acknowledged. `brake`: how long the brake takes to open.
  EnableMachine(TimePoint now, Duration brake) : brake_(brake), deadline_(now + shows_within) {}

  State look(const DriveSample& sample, bool elsewhere, TimePoint now);
  /// The drive could not be read.
  void silent() { state_ = State::not_shown; }
  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] bool goes_on() const { return state_ <= State::opening; }

 private:
  Duration brake_;
  TimePoint deadline_;
  TimePoint open_{};  ///< when the brake is; from `opening` on
  State state_ = State::waiting;
};

}  // namespace axisd
