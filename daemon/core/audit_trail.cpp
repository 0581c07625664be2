#include "daemon/core/audit_trail.hpp"

#include <chrono>
#include <utility>
#include <variant>

#include "devices/axis/command_digest.hpp"

namespace axisd::core {
namespace {

constexpr std::size_t most_clients = 1'000;

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

AuditTrail::Minute& AuditTrail::minute_of(const std::string& client) {
  const auto now = clock_->now();
  if (minutes_.size() >= most_clients && !minutes_.contains(client))
    std::erase_if(minutes_, [&](const auto& other) {
      return other.second.left_out == 0 && now - other.second.begin >= std::chrono::minutes(1);
    });
  // Beyond that they share one.
  auto& minute =
      minutes_[minutes_.size() < most_clients || minutes_.contains(client) ? client : std::string()];
  if (minute.told == 0 || now - minute.begin >= std::chrono::minutes(1)) {
    minute.begin = now;
    minute.told = 0;
  }
  return minute;
}

void AuditTrail::refused(const std::string& axis, const Action& action, const CommandOptions& options,
                         Error cause) {
  if (!kept()) return;
  auto& minute = minute_of(options.client);
  if (minute.told == refusals_a_minute) {
    ++minute.left_out;
    return;
  }
  ++minute.told;
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
                                 .accepted_at = clock_->wall(arrived)},
                     .left_out = std::exchange(minute.left_out, 0)});
}

void AuditTrail::call(AuditedCall call) {
  if (kept()) add(std::move(call));
}

}  // namespace axisd::core
