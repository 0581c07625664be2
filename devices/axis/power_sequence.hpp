// Sequences that move nothing: power, reset, and what the position means.
#pragma once

#include <optional>

#include "buses/task.hpp"
#include "devices/axis/activity.hpp"
#include "devices/axis/axis_context.hpp"
#include "devices/axis/power_machine.hpp"
#include "devices/axis/shaft.hpp"

namespace axisd {

class DriveConnection;
class Execution;
class LeaseDuty;
class Publisher;
class Readings;
class SavedPosition;
class StartWait;
class StateReader;
class Stopper;

/// Owns what is known of the power stage. Thread: core.
class PowerSequence {
 public:
  PowerSequence(const AxisContext& context, Shaft& shaft, Stopper& stopper, Execution& execution,
                StartWait& starts, StateReader& reader, Readings& readings, DriveConnection& connection,
                LeaseDuty& lease, SavedPosition& saved, Publisher& publisher)
      : context_(context),
        shaft_(shaft),
        stopper_(stopper),
        execution_(execution),
        starts_(starts),
        reader_(reader),
        readings_(readings),
        connection_(connection),
        lease_(lease),
        saved_(saved),
        publisher_(publisher) {}
  PowerSequence(const PowerSequence&) = delete;

  /// Switches the power stage on; done once the brake is open.
  Task<> run_enable(ActivityPtr activity);
  /// Stops, confirms standstill, then releases (M2).
  Task<> run_disable(ActivityPtr activity);
  /// Clears the drive's alarm and the fault, if the drive can be read back.
  Task<> run_reset(ActivityPtr activity);
  /// Declares the position, journalled before it is used (M20).
  Task<> run_set_position(ActivityPtr activity);
  /// The shaft turned although nothing was started: ErrorStop and a stop (M1, M23).
  void on_turned_by_power(const Error& cause);

  [[nodiscard]] PowerMachine& machine() { return power_; }
  [[nodiscard]] const PowerMachine& machine() const { return power_; }

 private:
  void end_enable(Activity& activity, EnableMachine::State state, std::optional<Error> unanswered);

  const AxisContext& context_;
  Shaft& shaft_;
  Stopper& stopper_;
  Execution& execution_;
  StartWait& starts_;
  StateReader& reader_;
  Readings& readings_;
  DriveConnection& connection_;
  LeaseDuty& lease_;
  SavedPosition& saved_;
  Publisher& publisher_;

  PowerMachine power_;
};

}  // namespace axisd
