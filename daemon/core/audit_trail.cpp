#include "daemon/core/audit_trail.hpp"

#include <utility>
#include <variant>

#include "devices/axis/command_digest.hpp"

namespace axisd::core {
namespace {

struct IsAudited {
  bool operator()(const CommandChange&) const { return true; }
  bool operator()(const AxisFault&) const { return true; }
  bool operator()(const LeaseChange&) const { return true; }
  bool operator()(const StopHoldChange&) const { return true; }
  bool operator()(const InhibitChange&) const { return true; }
  bool operator()(const ConfigurationReloaded&) const { return true; }
  bool operator()(const KeptStateChange&) const { return true; }
  // What the machine does by itself: of these the newest are in the events.
  bool operator()(const TerminalEdge&) const { return false; }
  bool operator()(const StateChange&) const { return false; }
  bool operator()(const LinkChange&) const { return false; }
  bool operator()(const ConfigurationDrift&) const { return false; }
  bool operator()(const FlightRecordWritten&) const { return false; }
};

}  // namespace

void AuditTrail::add(AuditContent content) {
  const auto now = clock_->now();
  sink_->add({.at = clock_->wall(now), .uptime = now.time_since_epoch(), .content = std::move(content)});
}

void AuditTrail::event(const Event& event) {
  if (kept() && std::visit(IsAudited{}, event.content)) add(event);
}

void AuditTrail::refused(const std::string& axis, const Action& action, const CommandOptions& options,
                         Error cause) {
  if (!kept()) return;
  const auto left_out = ration_.take(options.client, clock_->now());
  if (!left_out) return;
  const auto arrived = options.arrived == TimePoint{} ? clock_->now() : options.arrived;
  add(RefusedCommand{.command = {.id = {},
                                 .axis = axis,
                                 .request_id = options.request_id,
                                 .client = options.client,
                                 .lease_token = options.lease_token,
                                 .kind = kind_of(action),
                                 .asked = asked_by(action),
                                 .state = CommandState::aborted,
                                 .cause = std::move(cause),
                                 .accepted_at = clock_->wall(arrived),
                                 .origin = options.origin},
                     .left_out = *left_out});
}

void AuditTrail::call(AuditedCall call) {
  if (kept()) add(std::move(call));
}

}  // namespace axisd::core
