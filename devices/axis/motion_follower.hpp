// From the acknowledged start of a motion to its end.
#pragma once

#include <cstdint>
#include <optional>

#include "buses/task.hpp"
#include "devices/axis/activity.hpp"
#include "devices/axis/axis_context.hpp"
#include "devices/axis/shaft.hpp"
#include "devices/axis/unknown_outcomes.hpp"

namespace axisd {

class DriveConnection;
class Execution;
class Publisher;
class Readings;
class StateReader;
class Stopper;

/// MotionMachine and StartReadback judge the readings, and what follows from that is done here. Counts the
/// starts of which no reply said what became of them. Thread: core.
class MotionFollower {
 public:
  MotionFollower(const AxisContext& context, Shaft& shaft, Stopper& stopper, Execution& execution,
                 StateReader& reader, Readings& readings, DriveConnection& connection, Publisher& publisher)
      : context_(context),
        shaft_(shaft),
        stopper_(stopper),
        execution_(execution),
        reader_(reader),
        readings_(readings),
        connection_(connection),
        publisher_(publisher) {}
  MotionFollower(const MotionFollower&) = delete;

  /// What became of a trigger that was sent, and got no reply that says so. True: it was executed (M8).
  Task<bool> read_back(ActivityPtr activity, Error cause, std::int64_t base, TimePoint since);
  /// A motion by that plan, which was acknowledged at `since`.
  [[nodiscard]] MotionMachine followed(const Plan& plan, std::int64_t base, TimePoint since) const;
  /// Watches a motion until it ends. True: it rests at its target. False: it has ended otherwise.
  Task<bool> follow(ActivityPtr activity, std::int64_t base, TimePoint since);
  /// The same, by the drive that began it: when it was read at its target (M10).
  Task<std::optional<TimePoint>> arrived(ActivityPtr activity, std::int64_t base, TimePoint since);
  /// The reading at the target is not that of a drive that was restarted. False: it has ended.
  Task<bool> is_no_reboot(ActivityPtr activity);
  /// Nothing was sent, as the axis rested at its target: it still does. False: it has ended.
  Task<bool> still_there(ActivityPtr activity);

  /// Since start.
  [[nodiscard]] const UnknownOutcomes& unknown_starts() const { return unknown_starts_; }
  /// Nobody will ever know of one.
  void count_unresolved() { ++unknown_starts_.unresolved; }

 private:
  [[nodiscard]] std::optional<StartReadback::Reading> readback_of(std::int64_t base) const;
  void expect_end(const Plan& plan, std::int64_t base, TimePoint since);
  [[nodiscard]] MotionMachine::Reading reading_of(const Plan& plan, std::int64_t base) const;
  void end_hold(Activity& activity);
  void end_motion(Activity& activity, MotionMachine::State state);
  void end_at_rest(Activity& activity);
  [[nodiscard]] bool shows(const Plan& plan, std::int64_t base) const;
  [[nodiscard]] bool held_back(const Plan& plan) const;
  [[nodiscard]] bool is_astray(const Plan& plan, std::int64_t base) const;
  Task<bool> proven_continuous(ActivityPtr activity);

  const AxisContext& context_;
  Shaft& shaft_;
  Stopper& stopper_;
  Execution& execution_;
  StateReader& reader_;
  Readings& readings_;
  DriveConnection& connection_;
  Publisher& publisher_;

  UnknownOutcomes unknown_starts_;
};

}  // namespace axisd
