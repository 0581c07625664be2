// Commands of an earlier run of the daemon: what became of what it may have sent.
#pragma once

#include <string_view>

#include "buses/task.hpp"
#include "devices/axis/axis_context.hpp"
#include "devices/axis/axis_life.hpp"
#include "devices/axis/earlier_run.hpp"
#include "devices/axis/power_machine.hpp"
#include "devices/axis/shaft.hpp"
#include "devices/axis/stop_machine.hpp"

namespace axisd {

class Execution;
class Publisher;
class Readings;

/// Owes a stop to what may run, and asks the drive once it rests. Thread: core.
class EarlierCommands {
 public:
  EarlierCommands(const AxisContext& context, const AxisLife& life, Shaft& shaft, PowerMachine& power,
                  StopMachine& stop, Execution& execution, Readings& readings, Publisher& publisher)
      : context_(context),
        life_(life),
        shaft_(shaft),
        power_(power),
        stop_(stop),
        execution_(execution),
        readings_(readings),
        publisher_(publisher) {}
  EarlierCommands(const EarlierCommands&) = delete;

  /// What the run before this one left: a drive that may run, and outcomes that nobody has looked at (M4).
  void take_over();
  /// Judges by a drive that rests, before anything in it is changed. Errors: it moves, or does not answer.
  Task<Result<void>> settle_earlier();
  /// Ends those that set a position: it was done if it is what was found saved.
  void settle_positions_set();
  /// Ends those of which the drive could not be asked in time.
  void give_up_if_overdue();

  [[nodiscard]] EarlierRun& run() { return run_; }
  [[nodiscard]] const EarlierRun& run() const { return run_; }

 private:
  void owe_stop_of_motion();
  void settle_as(const Unsettled& earlier, bool continuous);
  void settle_as_unknown(const Unsettled& earlier, std::string_view why);
  void give_up_settling();
  [[nodiscard]] Error earlier_error(const Unsettled& earlier, std::string_view what, Outcome outcome) const;

  const AxisContext& context_;
  const AxisLife& life_;
  Shaft& shaft_;
  PowerMachine& power_;
  StopMachine& stop_;
  Execution& execution_;
  Readings& readings_;
  Publisher& publisher_;

  EarlierRun run_;
};

}  // namespace axisd
