// Homing: by the drive itself, watched from here (M21).
#pragma once

#include <cstdint>

#include "buses/task.hpp"
#include "devices/axis/activity.hpp"
#include "devices/axis/axis_context.hpp"
#include "devices/axis/homing_machine.hpp"
#include "devices/axis/shaft.hpp"
#include "devices/axis/stop_machine.hpp"

namespace axisd {

class Execution;
class MotionSequence;
class Readings;
class SavedPosition;
class StartWait;
class StateReader;

/// The sequence of homing. Thread: core.
class HomingSequence {
 public:
  HomingSequence(const AxisContext& context, Shaft& shaft, StopMachine& stop, Execution& execution,
                 StartWait& starts, StateReader& reader, Readings& readings, MotionSequence& motion,
                 SavedPosition& saved)
      : context_(context),
        shaft_(shaft),
        stop_(stop),
        execution_(execution),
        starts_(starts),
        reader_(reader),
        readings_(readings),
        motion_(motion),
        saved_(saved) {}
  HomingSequence(const HomingSequence&) = delete;

  /// Backs off from an active switch, homes, and declares the position at home.
  Task<> run_home(ActivityPtr activity);

 private:
  Task<> declare_home(ActivityPtr activity);
  Task<bool> back_off(ActivityPtr activity);
  [[nodiscard]] HomingMachine followed_homing(TimePoint since, bool homed_before) const;
  Task<bool> follow_homing(ActivityPtr activity, TimePoint since, bool homed_before);
  [[nodiscard]] Error not_homed(HomingMachine::State state) const;
  [[nodiscard]] Error reached_switch() const;
  [[nodiscard]] std::int64_t counter_at_home() const;

  const AxisContext& context_;
  Shaft& shaft_;
  StopMachine& stop_;
  Execution& execution_;
  StartWait& starts_;
  StateReader& reader_;
  Readings& readings_;
  MotionSequence& motion_;
  SavedPosition& saved_;
};

}  // namespace axisd
