// Reading the state of a drive again and again, and noticing that it is gone or was restarted.
#pragma once

#include <optional>

#include "buses/clock.hpp"
#include "buses/signal.hpp"
#include "buses/task.hpp"
#include "devices/axis/axis_context.hpp"
#include "devices/axis/continuity.hpp"
#include "devices/axis/link_machine.hpp"
#include "devices/axis/poll_pace.hpp"
#include "devices/axis/power_machine.hpp"
#include "devices/axis/shaft.hpp"

namespace axisd {

class DriftCheck;
class DriveConnection;
class Execution;
class Publisher;
class Readings;
class Stopper;

/// Decides when the drive is read, and proves that it was not restarted. Thread: core.
class StateReader {
 public:
  StateReader(const AxisContext& context, Shaft& shaft, const LinkMachine& link, const PowerMachine& power,
              Stopper& stopper, const Execution& execution, Readings& readings, DriveConnection& connection,
              DriftCheck& drift, Publisher& publisher);
  StateReader(const StateReader&) = delete;

  /// An uninterrupted use of the node: keeps the poll loop off it while it lives (M6).
  class Chain {
   public:
    explicit Chain(StateReader& reader);
    ~Chain();
    Chain(const Chain&) = delete;

   private:
    StateReader* reader_;
  };

  /// Reads it until the link is gone.
  Task<> poll();
  /// The poll loop has something to look at.
  void wake();
  /// Notified by wake().
  [[nodiscard]] Signal& woken() { return wake_; }
  /// Looks from now on whether the drive was unheard of for too long, until it is offline.
  void watch_continuity();
  /// The drive was not restarted since its parameters were last written. Errors: rebooted, no_reply.
  Task<Result<void>> prove_continuity(TransactionClass priority);
  /// Reads the drive's state, unless the last reading is not older than `oldest`. Errors: as of
  /// Drive::read_state().
  Task<Result<void>> look(Duration oldest);
  /// Waits for a sample whose request went out at `since` or later.
  Task<Result<DriveSample>> sample_after(TimePoint since, Duration patience);
  /// Polls as fast as the bus can, while the axis is busy, from `from` on and for `longest` at most.
  void poll_fast(TimePoint from, Duration longest);
  /// The same for the end of a motion, which may come a little later than `from`.
  void poll_for_end(TimePoint from, Duration longest);
  /// What was just started is not read before, where readings of a line wait for each other.
  void keep_quiet(TimePoint until);

  [[nodiscard]] Continuity& continuity() { return continuity_; }
  [[nodiscard]] const Continuity& continuity() const { return continuity_; }
  [[nodiscard]] PollPace& pace() { return pace_; }

 private:
  struct Polling {
    int failures = 0;    ///< in a row
    bool woken = false;  ///< in place of a sample
    /// Continuity was to be proven then beside a sample, and was not yet.
    TimePoint proof_due = TimePoint::max();
    bool repeated = false;  ///< the sample was asked for later than by the poll loop
  };
  [[nodiscard]] TimePoint next_poll(const Polling& polling, TimePoint began) const;
  Task<bool> poll_once(Polling& polling);
  Task<Result<void>> read_next(Polling& polling);
  bool outlives(Polling& polling, Error cause);
  [[nodiscard]] Error not_heard() const;
  Task<Result<std::optional<DriveSample>>> next_sample(Polling& polling);
  bool seen_again(const DriveSample& sample);
  [[nodiscard]] bool only_watches() const;
  [[nodiscard]] bool keeps_quiet() const;

  const AxisContext& context_;
  Shaft& shaft_;
  const LinkMachine& link_;
  const PowerMachine& power_;
  Stopper& stopper_;
  const Execution& execution_;
  Readings& readings_;
  DriveConnection& connection_;
  DriftCheck& drift_;
  Publisher& publisher_;

  PollPace pace_;
  Continuity continuity_;
  Clock::Timer continuity_watch_;
  Signal wake_;  ///< the poll loop has something to look at
  int chains_ = 0;
};

}  // namespace axisd
