#pragma once

#include <optional>

#include "devices/axis/stop_delays.hpp"
#include "devices/budget.hpp"
#include "devices/drive.hpp"

namespace axisd {

/// Notes the longest times of one axis, from the times of the frames themselves. Pure. Thread: core.
class ObservedTimes {
 public:
  /// `delays`: where stops are counted, too; may be null.
  explicit ObservedTimes(StopDelays* delays = nullptr) : delays_(delays) {}

  /// A reading by the poll loop. `busy`: the axis has something to do, and is polled fast.
  void on_sample(const DriveSample& sample, bool busy);
  /// The next reading does not follow the last one: something else had the node, or it was away.
  void interrupted() { last_.reset(); }

  /// `arrived`: at the server. `all`: of a stop of all axes. A stop that the axis decided on itself has none.
  void stop_requested(TimePoint arrived, bool all);
  /// By the bus budget, from the request to the frame's end.
  void expect_stop_within(Duration bound) { expected_stop_ = bound; }
  struct Late {
    Duration seen, expected;
  };
  /// The stop frame's last byte or bit, of the first one and of the first that was `answered`. Returns the
  /// first answered one that took longer than expected: what a drive does not hear it cannot get in time.
  std::optional<Late> stop_sent(TimePoint end, bool answered);
  void standstill_confirmed(TimePoint at);
  /// Standstill was not confirmed, and will not be for this request.
  void stop_failed() { stop_.reset(); }

  [[nodiscard]] const ObservedAxis& values() const { return values_; }

 private:
  struct Last {
    TimePoint asked_at;
    bool busy, moving;
  };
  struct Stop {
    TimePoint arrived;
    bool all = false, sent = false, answered = false;
  };
  StopDelays* delays_;
  std::optional<Last> last_;
  std::optional<Stop> stop_;
  Duration expected_stop_ = Duration::max();
  ObservedAxis values_;
};

}  // namespace axisd
