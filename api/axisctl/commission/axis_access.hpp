// One axis of a daemon, as a commissioning commands it.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "api/axisctl/commission/held_lease.hpp"
#include "api/axisctl/commission/plan.hpp"
#include "api/axisctl/invocation.hpp"
#include "axisd/v1/budget.pb.h"
#include "axisd/v1/drive_service.pb.h"
#include "axisd/v1/system_service.pb.h"

namespace axisd::axisctl::commission {

/// All calls throw Failure. Thread: one, except stop_at_once().
class AxisAccess {
 public:
  AxisAccess(Invocation& invocation, std::string axis) : invocation_(invocation), axis_(std::move(axis)) {}

  [[nodiscard]] const std::string& name() const { return axis_; }
  [[nodiscard]] const Client& client() const { return invocation_.client(); }

  v1::AxisState state() { return invocation_.state(axis_); }
  v1::GetInfoResponse info();
  v1::GetConfigResponse configuration();
  v1::GetDriveResponse drive();
  /// What the bus publishes about this axis; nothing: it does not.
  std::optional<v1::AxisBudget> budget(const std::string& bus);
  /// What would become of a command, under the lease that is held.
  v1::ExplainResponse explain(v1::ExplainRequest request);
  v1::ExplainResponse explain_move(double distance, double velocity);
  v1::ExplainResponse explain_target(double position);
  /// Velocities that the daemon permits for a move.
  VelocityRange velocities();

  void acquire_lease(const std::string& label);
  /// The lease was had at some time: what moves since then is ours to stop. Thread: any.
  [[nodiscard]] bool ours() const { return ours_; }
  void release_lease() { lease_.reset(); }
  /// Why the lease is over; empty: it is held.
  [[nodiscard]] std::string lease_lost() const { return lease_ ? lease_->lost() : "it was released"; }

  // Nothing of these is sent any more once stop_at_once() was called. They return when it is accepted.
  v1::Command enable();
  v1::Command move(double distance, double velocity);
  v1::Command home();

  // Never in the way of a stop.
  v1::Command disable();
  v1::Command stop(bool hold);  ///< returns when it has ended
  void release_stop();
  /// Releases a stop that this held, if it still does.
  void end_hold();
  v1::Command command(const std::string& id);

  /// Lets nothing start afterwards, and stops the axis if it is ours: what another client moves is left
  /// alone. Never throws. Thread: any.
  void stop_at_once() noexcept;
  [[nodiscard]] bool stopped_at_once() const { return stopped_; }

 private:
  template <class Method, class Request>
  v1::Command start(Method method, Request request);
  [[nodiscard]] v1::CommandOptions options() const;

  Invocation& invocation_;
  std::string axis_;
  std::unique_ptr<HeldLease> lease_;
  const std::string hold_id_ = random_uuid();  ///< of its stops with hold
  bool holds_ = false;                         ///< a stop with hold was asked for, and not released since
  std::atomic<bool> ours_ = false;
  std::atomic<bool> stopped_ = false;
  std::mutex starting_;  ///< held while a start is on its way to the daemon
};

}  // namespace axisd::axisctl::commission
