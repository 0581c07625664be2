// The sequences of motions.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "buses/task.hpp"
#include "devices/axis/activity.hpp"
#include "devices/axis/axis_context.hpp"
#include "devices/axis/motion_aim.hpp"
#include "devices/axis/motion_follower.hpp"
#include "devices/axis/shaft.hpp"

namespace axisd {

class DriveConnection;
class Execution;
class PowerSequence;
class Publisher;
class Readings;
class SavedPosition;
class StartWait;
class StateReader;
class Stopper;

/// Each reads top to bottom; after every wait it asks whether it is still current, and leaves if not.
/// Thread: core.
class MotionSequence {
 public:
  MotionSequence(const AxisContext& context, Shaft& shaft, Stopper& stopper, Execution& execution,
                 StartWait& starts, StateReader& reader, Readings& readings, DriveConnection& connection,
                 PowerSequence& power_sequence, SavedPosition& saved, Publisher& publisher)
      : context_(context),
        shaft_(shaft),
        stopper_(stopper),
        execution_(execution),
        starts_(starts),
        reader_(reader),
        readings_(readings),
        connection_(connection),
        power_sequence_(power_sequence),
        saved_(saved),
        publisher_(publisher) {}
  MotionSequence(const MotionSequence&) = delete;

  /// A move to a target.
  Task<> run_move(ActivityPtr activity);
  /// A velocity move or a jog: a move to its end, or speed mode.
  Task<> run_velocity(ActivityPtr activity);
  /// A member of a group, whose start was sent.
  Task<> run_member(ActivityPtr activity, std::int64_t base, TimePoint since, bool there,
                    std::shared_ptr<std::optional<TimePoint>> arrival);
  /// Lets a halt in progress end (M9). False: it has ended.
  Task<bool> reach_standstill(ActivityPtr activity);
  /// One positioning motion to the target of its plan. False: it has ended.
  Task<bool> positioned(ActivityPtr activity);
  /// Judges what became of its start. True: it was executed.
  Task<bool> started(ActivityPtr activity, Result<void> result, std::int64_t base, TimePoint since);

  [[nodiscard]] MotionAim& aim() { return aim_; }
  [[nodiscard]] MotionFollower& follower() { return follower_; }
  [[nodiscard]] const MotionFollower& follower() const { return follower_; }

 private:
  Task<std::optional<Result<void>>> start_unmoved(ActivityPtr activity);

  const AxisContext& context_;
  Shaft& shaft_;
  Stopper& stopper_;
  Execution& execution_;
  StartWait& starts_;
  StateReader& reader_;
  Readings& readings_;
  DriveConnection& connection_;
  PowerSequence& power_sequence_;
  SavedPosition& saved_;
  Publisher& publisher_;

  MotionAim aim_{context_, shaft_, execution_, reader_, readings_, saved_};
  MotionFollower follower_{context_, shaft_,    stopper_,    execution_,
                           reader_,  readings_, connection_, publisher_};
};

}  // namespace axisd
