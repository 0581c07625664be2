// Following a motion from its acknowledged start to its end (M10), and finding out whether one began (M8).
#pragma once

#include <cstdint>
#include <optional>

#include "buses/clock.hpp"
#include "devices/drive_values.hpp"

namespace axisd {

/// Judges the readings of a motion that was started. It counts what a reading from after the start shows,
/// and nothing older. Pure. Thread: core.
///
///   starting -- moves, or is elsewhere than it was ------------------------> running
///   starting -- its way is too short to be seen, and its time is over,
///               and so is the start window: a drive may begin late ---------> running
///   starting -- rests, by a reading from after the start window -----------> did_not_start
///   running  -- at rest at the target, and in position as its drive says --> arrived
///   running  -- at rest otherwise -----------------------------------------> settling
///   settling -- at rest at the target, and never far from it for `still` --> arrived
///   settling -- moves -----------------------------------------------------> running
///   running, settling -- elsewhere: held back, or for longer than a shaft
///                        settles since it rests or was seen at its target -> rests_elsewhere
///   arrived  -- go_on(): something has moved it since ---------------------> running
///   starting, running, settling -- another mode of the drive --------------> taken_over
///   any of these -- moves away from its target -----------------------------> astray
///   running, settling -- far longer than predicted ------------------------> took_too_long
class MotionMachine {
 public:
  enum class State : std::uint8_t {
    starting,  ///< acknowledged, and not seen yet
    running,
    settling,  ///< at rest, and not at its target, or not for long enough
    arrived,
    // It has ended otherwise:
    rests_elsewhere,
    taken_over,
    astray,  ///< it executes another motion than this one
    did_not_start,
    took_too_long,
  };
  struct Motion {
    TimePoint since{};     ///< its start was acknowledged
    Duration predicted{};  ///< from start to standstill
    bool endless = false;  ///< it has no target
    bool unseen = false;   ///< its way is too short for a reading to show it
    Duration settling{};   ///< a measured position comes to its target so late, at most (M30)
  };
  struct Reading {
    TimePoint asked_at{};
    bool positioning = true;  ///< the mode of the drive
    bool moving = false;
    bool elsewhere = false;    ///< than where it started
    bool at_target = false;    ///< of a motion that has one
    bool near_target = false;  ///< or beside it by no more than a reading may waver
    bool beside = false;       ///< neither where it started nor at its target, whatever took it there
    bool in_position = false;  ///< its drive says so, or counts its position: one reading is enough
    bool held_back = false;    ///< by a limit or a stop terminal
    bool astray = false;       ///< further from where it started, or from its target, than this motion goes
  };

  /// A shaft that rings about its target crosses it: so long it is to be read there before it has settled.
  static constexpr Duration still = std::chrono::milliseconds(20);

  explicit MotionMachine(const Motion& motion) : motion_(motion) {}

  State look(const Reading& reading);
  /// It is looked at again, after it had arrived.
  void go_on();

  [[nodiscard]] State state() const { return state_; }
  /// By then it has ended, or takes too long.
  [[nodiscard]] TimePoint latest() const;

 private:
  [[nodiscard]] State judge_rest(const Reading& reading);

  Motion motion_;
  State state_ = State::starting;
  /// At rest since this reading, whether it has begun or not; or last seen at its target then.
  std::optional<TimePoint> rests_since_;
  /// At rest at its target by this reading, and near it by all since.
  std::optional<TimePoint> there_since_;
  /// At rest beside it before its motion was known to have begun: it is not settled by one reading.
  bool was_beside_ = false;
};

/// What became of a start whose trigger was sent and got no reply that says so (M8). Pure. Thread: core.
///
///   reading -- moves, is elsewhere, or in another mode ------------> executed
///   reading -- rests, by a reading from after the start window ----> resting
///   resting -- proven(): not restarted, and a reading would tell --> not_executed
///   resting -- proven(): a reading would not tell ----------------> unresolved
///   reading, resting -- superseded() ------------------------------> unresolved
class StartReadback {
 public:
  enum class State : std::uint8_t { reading, resting, executed, not_executed, unresolved };
  struct Reading {
    TimePoint asked_at{};
    bool shows_it = false;  ///< it moves, is elsewhere than it was, or does something else
  };

  /// `since`: when its trigger had been sent.
  explicit StartReadback(TimePoint since) : since_(since) {}

  /// What is read at `now`, if anything was.
  State look(const std::optional<Reading>& reading, TimePoint now);
  /// The drive was not restarted since: that rest is no consequence of it. `tellable`: a motion of that kind
  /// would show in the position, and nothing can have ended it as it began.
  State proven(bool tellable);
  /// The command has ended otherwise, or the proof failed.
  State superseded() { return state_ = State::unresolved; }

  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] TimePoint deadline() const { return since_ + start_window; }

 private:
  TimePoint since_;
  State state_ = State::reading;
};

}  // namespace axisd
