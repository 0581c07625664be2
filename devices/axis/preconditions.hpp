// Preconditions of requests: each is looked at in one place, for refusals and for explanations.
#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "devices/axis/axis_context.hpp"
#include "devices/axis/axis_life.hpp"
#include "devices/axis/link_machine.hpp"
#include "devices/axis/motion_plans.hpp"
#include "devices/axis/obstacles.hpp"
#include "devices/axis/power_machine.hpp"
#include "devices/axis/shaft.hpp"
#include "devices/axis/stop_machine.hpp"

namespace axisd {

class DriftCheck;
class DriveWork;
class Execution;
class StartWait;

/// Only looks: nothing here waits, changes anything, or touches the wire. Thread: core.
class Preconditions {
 public:
  Preconditions(const AxisContext& context, const AxisLife& life, const Shaft& shaft, const LinkMachine& link,
                const PowerMachine& power, const StopMachine& stop, const DriftCheck& drift,
                const DriveWork& work, const StartWait& starts, const Execution& execution)
      : context_(context),
        life_(life),
        shaft_(shaft),
        link_(link),
        power_(power),
        stop_(stop),
        drift_(drift),
        work_(work),
        starts_(starts),
        execution_(execution) {}
  Preconditions(const Preconditions&) = delete;

  /// Everything that stands in the way of a request now; of none: of motion in general.
  [[nodiscard]] std::vector<Obstacle> explain(const std::optional<Action>& action,
                                              const CommandOptions& options) const;
  /// What does not hold of what each request needs, in the order of refusals.
  void look_at(const EnableRequest& request, const CommandOptions& options, Obstacles& found) const;
  void look_at(const DisableRequest& request, const CommandOptions& options, Obstacles& found) const;
  void look_at(const HomeRequest& request, const CommandOptions& options, Obstacles& found) const;
  void look_at(const MoveAbsoluteRequest& request, const CommandOptions& options, Obstacles& found) const;
  void look_at(const MoveRelativeRequest& request, const CommandOptions& options, Obstacles& found) const;
  void look_at(const MoveVelocityRequest& request, const CommandOptions& options, Obstacles& found) const;
  void look_at(const JogRequest& request, const CommandOptions& options, Obstacles& found) const;
  void look_at(const StopRequest&, const CommandOptions&, Obstacles&) const {}  ///< never refused
  void look_at(const ResetRequest& request, const CommandOptions& options, Obstacles& found) const;
  void look_at(const SetPositionRequest& request, const CommandOptions& options, Obstacles& found) const;
  void look_at(const GroupMemberRequest& request, const CommandOptions& options, Obstacles& found) const;
  /// Of a request that may have to wait for others.
  void look_at_buffered(const Action& action, CommandOptions options, Obstacles& found) const;
  /// A repeated call with the same velocity extends the held motion that it started.
  [[nodiscard]] bool renews(const Action& action, const CommandOptions& options) const;
  /// Errors: offline, configuring.
  [[nodiscard]] Result<void> check_online() const;
  /// Errors: lease_required, lease_lost.
  [[nodiscard]] Result<void> check_lease(const Requester& requester) const;
  [[nodiscard]] const MotionPlans& plans() const { return plans_; }

 private:
  [[nodiscard]] bool too_late(const CommandOptions& options) const;
  [[nodiscard]] Result<void> check_journal() const;
  void look_at_options(const CommandOptions& options, Obstacles& found) const;
  void look_at_holds(const CommandOptions& options, Obstacles& found) const;
  void look_at_link(Obstacles& found) const;
  void look_at_fault(Obstacles& found) const;
  void look_at_maintenance(Obstacles& found) const;
  /// Of everything but stops and Reset; StopAll does not forbid what moves nothing.
  void look_at_readiness(const CommandOptions& options, Obstacles& found) const;
  /// Of every motion.
  void look_at_motion(const CommandOptions& options, Obstacles& found) const;
  void look_at_direction(bool positive, Obstacles& found) const;
  void look_at_target(const PositionTracker::Target& target, Obstacles& found) const;
  void look_at_velocity(double velocity, const MotionValues& with, bool jog, Obstacles& found) const;
  void look_at_holding_terminals(std::span<const std::string_view> functions, Obstacles& found) const;
  void look_at_present_motion(Obstacles& found) const;
  void look_at_line(Obstacles& found) const;
  void look_at_what_forbids_some(Obstacles& found) const;

  const AxisContext& context_;
  const AxisLife& life_;
  const Shaft& shaft_;
  const LinkMachine& link_;
  const PowerMachine& power_;
  const StopMachine& stop_;
  const DriftCheck& drift_;
  const DriveWork& work_;
  const StartWait& starts_;
  const Execution& execution_;

  MotionPlans plans_{context_, shaft_, execution_};
};

}  // namespace axisd
