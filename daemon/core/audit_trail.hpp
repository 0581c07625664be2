#pragma once

#include <set>
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
  /// Commands, faults, and what somebody did to leases, holds, StopAll, the configuration and the state. Of
  /// stops, which are refused to nobody, each identity has a ration.
  void event(const Event& event);
  /// `group`: that it names; empty: none.
  void refused(const std::string& axis, const Action& action, const CommandOptions& options, Error cause,
               std::string group = {});
  void call(AuditedCall call);

 private:
  void add(AuditContent content);
  [[nodiscard]] bool is_within_ration(const Event& event);

  Clock* clock_;
  AuditSink* sink_;
  Ration refusals_{audit_ration::refusals}, stops_{audit_ration::stops};  ///< of identities
  std::set<std::string> untold_;  ///< ids of stops that have not ended
};

}  // namespace axisd::core
