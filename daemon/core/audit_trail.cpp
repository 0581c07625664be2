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
  bool operator()(const EepromWritten&) const { return true; }
  // What the machine does by itself: of these the newest are in the events.
  bool operator()(const TerminalEdge&) const { return false; }
  bool operator()(const StateChange&) const { return false; }
  bool operator()(const LinkChange&) const { return false; }
  bool operator()(const ConfigurationDrift&) const { return false; }
  bool operator()(const FlightRecordWritten&) const { return false; }
  bool operator()(const CertificateNotice&) const { return false; }
};

/// Who stopped or held something, or ceased to hold it; nullptr: it is something else.
struct WhoStops {
  const std::string* operator()(const CommandChange& change) const {
    const auto kind = change.command->kind;
    const bool stop =
        kind == CommandKind::halt || kind == CommandKind::stop || kind == CommandKind::quick_stop;
    return stop ? &change.command->client : nullptr;
  }
  const std::string* operator()(const StopHoldChange& change) const {
    return change.by.empty() ? &change.hold.holder : &change.by;
  }
  const std::string* operator()(const InhibitChange& change) const {
    return change.what == InhibitChange::What::latched ? &change.by : nullptr;
  }
  template <class Other>
  const std::string* operator()(const Other&) const {
    return nullptr;
  }
};

}  // namespace

void AuditTrail::add(AuditContent content) {
  const auto now = clock_->now();
  sink_->add({.at = clock_->wall(now), .uptime = now.time_since_epoch(), .content = std::move(content)});
}

void AuditTrail::event(const Event& event) {
  if (kept() && std::visit(IsAudited{}, event.content) && is_within_ration(event)) add(event);
}

bool AuditTrail::is_within_ration(const Event& event) {
  const auto* change = std::get_if<CommandChange>(&event.content);
  if (change != nullptr && ended(change->command->state)) return untold_.erase(change->command->id) == 0;
  const auto* who = std::visit(WhoStops{}, event.content);
  if (who == nullptr) return true;
  const auto left_out = stops_.take(identity_of(*who), clock_->now());
  if (left_out.value_or(0) > 0)
    add(AuditGap{.left_out = *left_out, .client = std::string(identity_of(*who))});
  if (!left_out && change != nullptr) untold_.insert(change->command->id);
  return left_out.has_value();
}

void AuditTrail::refused(const std::string& axis, const Action& action, const CommandOptions& options,
                         Error cause, std::string group) {
  if (!kept()) return;
  const auto left_out = refusals_.take(identity_of(options.client), clock_->now());
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
                     .group = std::move(group),
                     .left_out = *left_out});
}

void AuditTrail::call(AuditedCall call) {
  if (kept()) add(std::move(call));
}

}  // namespace axisd::core
