// What follows from a reading of the drive.
#pragma once

#include <optional>

#include "devices/axis/axis_context.hpp"
#include "devices/axis/link_machine.hpp"
#include "devices/axis/power_machine.hpp"
#include "devices/axis/shaft.hpp"
#include "devices/axis/speed_watch.hpp"
#include "devices/axis/stop_machine.hpp"

namespace axisd {

class Execution;
class LeaseDuty;
class Publisher;
class SavedPosition;
class StateReader;
class Stopper;

/// The one place where a reading changes what is known of the axis. Watches the speed of what was started.
/// Thread: core.
class Readings {
 public:
  Readings(const AxisContext& context, Shaft& shaft, const LinkMachine& link, PowerMachine& power,
           StopMachine& stop, Stopper& stopper, Execution& execution, StateReader& reader, LeaseDuty& lease,
           SavedPosition& saved, Publisher& publisher)
      : context_(context),
        shaft_(shaft),
        link_(link),
        power_(power),
        stop_(stop),
        stopper_(stopper),
        execution_(execution),
        reader_(reader),
        lease_(lease),
        saved_(saved),
        publisher_(publisher) {}
  Readings(const Readings&) = delete;

  /// A new reading: takes it in, does what follows from it, and publishes.
  void on_sample(const DriveSample& sample);
  /// The position is not to be believed any more (M20).
  void lose_trust();
  /// Ends what is under way as a fault where it is far faster than told. True: it has.
  bool watch_speed(SpeedWatch::Event event);

 private:
  void on_alarm(const DriveSample& sample);
  void on_released(const DriveSample& sample, bool enabled_before);
  void on_unexplained_motion(const DriveSample& sample, const std::optional<DriveSample>& before);
  [[nodiscard]] ShaftWatch::Facts shaft_facts() const;

  const AxisContext& context_;
  Shaft& shaft_;
  const LinkMachine& link_;
  PowerMachine& power_;
  StopMachine& stop_;
  Stopper& stopper_;
  Execution& execution_;
  StateReader& reader_;
  LeaseDuty& lease_;
  SavedPosition& saved_;
  Publisher& publisher_;

  SpeedWatch speed_watch_{static_cast<double>(context_.settings.scale.pulses_per_revolution)};
};

}  // namespace axisd
