// Stopping: one sequence per axis sends, confirms and escalates (M12 to M14).
#pragma once

#include "buses/signal.hpp"
#include "buses/task.hpp"
#include "devices/axis/axis_context.hpp"
#include "devices/axis/link_machine.hpp"
#include "devices/axis/observed_times.hpp"
#include "devices/axis/shaft.hpp"
#include "devices/axis/standstill.hpp"
#include "devices/axis/stop_machine.hpp"

namespace axisd {

class DriveConnection;
class Execution;
class Publisher;
class Readings;
class SavedPosition;
class Sequences;
class StateReader;

/// Does what StopMachine says, and notes how long stops take. Thread: core.
class Stopper {
 public:
  Stopper(const AxisContext& context, Sequences& sequences, Shaft& shaft, DriveConnection& connection,
          const LinkMachine& link, StateReader& reader, Readings& readings, Execution& execution,
          SavedPosition& saved, Publisher& publisher);
  Stopper(const Stopper&) = delete;

  /// Sends a stop at once, and confirms it. `command` ends with it; nullptr: the axis decided on it itself.
  void begin_stop(StopKind kind, CommandPtr command);
  /// How long the drive brakes in such a stop, at most.
  [[nodiscard]] Duration braking_time(StopKind kind) const;
  /// Looks for the standstill of a node that nobody polls. `of_stop`: another stop than the one under way
  /// ends it.
  Task<bool> standstill_unpolled(TimePoint deadline, bool of_stop);

  [[nodiscard]] StopMachine& machine() { return stop_; }
  [[nodiscard]] const StopMachine& machine() const { return stop_; }
  /// Notified when the stop sequence has ended.
  [[nodiscard]] Signal& stopped() { return stopped_; }
  [[nodiscard]] ObservedTimes& observed() { return observed_; }
  [[nodiscard]] const ObservedTimes& observed() const { return observed_; }

 private:
  Task<> run_stop();
  void note_stop_sent(TimePoint end, bool answered);
  Task<Result<void>> stop_and_confirm();
  [[nodiscard]] Error not_stopped(StopMachine::Step step, const Result<void>& sent) const;
  Task<RestVerdict> rests_in_time(bool acknowledged, TimePoint since);
  Task<RestVerdict> standstill_by(bool acknowledged, TimePoint deadline);

  const AxisContext& context_;
  Sequences& sequences_;
  Shaft& shaft_;
  DriveConnection& connection_;
  const LinkMachine& link_;
  StateReader& reader_;
  Readings& readings_;
  Execution& execution_;
  SavedPosition& saved_;
  Publisher& publisher_;

  StopMachine stop_;
  Signal stopped_;
  ObservedTimes observed_;
};

}  // namespace axisd
