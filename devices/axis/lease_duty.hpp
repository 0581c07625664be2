// What an axis does when the lease that it was commanded under ends.
#pragma once

#include "devices/axis/axis_context.hpp"
#include "devices/axis/link_machine.hpp"
#include "devices/axis/power_machine.hpp"
#include "devices/axis/shaft.hpp"
#include "devices/axis/stop_machine.hpp"

namespace axisd {

class Acceptance;
class Execution;
class Publisher;
class Stopper;

/// Does what `on_lease_loss` says, and releases the drive as soon as that can be. Thread: core.
class LeaseDuty {
 public:
  LeaseDuty(const AxisContext& context, const Shaft& shaft, const LinkMachine& link, PowerMachine& power,
            const StopMachine& stop, Stopper& stopper, Execution& execution, Acceptance& acceptance,
            Publisher& publisher)
      : context_(context),
        shaft_(shaft),
        link_(link),
        power_(power),
        stop_(stop),
        stopper_(stopper),
        execution_(execution),
        acceptance_(acceptance),
        publisher_(publisher) {}
  LeaseDuty(const LeaseDuty&) = delete;

  /// The lease under which the axis was commanded is over, and the gate knows it: does what the
  /// configuration says (M16). Motion that has not started by then never does.
  void lease_lost(const Error& cause);
  /// What is being executed, if it was given without a lease and needs one where there is one; else nullptr.
  [[nodiscard]] const Command* commanded_without_lease() const;
  /// `on_lease_loss: disable` is done as soon as that can be.
  void release_as_owed();
  /// The drive took part, and is not released: it is not tried again.
  void give_up_release(const Error& cause);

 private:
  const AxisContext& context_;
  const Shaft& shaft_;
  const LinkMachine& link_;
  PowerMachine& power_;
  const StopMachine& stop_;
  Stopper& stopper_;
  Execution& execution_;
  Acceptance& acceptance_;
  Publisher& publisher_;
};

}  // namespace axisd
