#pragma once

#include <string>

#include "buses/clock.hpp"
#include "devices/audit.hpp"
#include "devices/audit_ration.hpp"

namespace axisd::core {

/// What of that which happens on a machine goes into the audit. Thread: core.
class AuditTrail {
 public:
  /// `sink` may be null: nothing is kept.
  AuditTrail(Clock& clock, AuditSink* sink) : clock_(&clock), sink_(sink) {}

  [[nodiscard]] bool kept() const { return sink_ != nullptr; }
  /// Commands, faults, and what somebody did to leases, holds, StopAll, the configuration and the state.
  void event(const Event& event);
  void refused(const std::string& axis, const Action& action, const CommandOptions& options, Error cause);
  void call(AuditedCall call);

 private:
  void add(AuditContent content);

  Clock* clock_;
  AuditSink* sink_;
  AuditRation ration_;  ///< of refusals
};

}  // namespace axisd::core
