#include "api/server/event_convert.hpp"

#include <utility>
#include <variant>

#include "api/server/convert.hpp"

namespace axisd::server {
namespace {

void fill(const TerminalEdge& from, v1::Event& event) {
  auto& to = *event.mutable_terminal_edge();
  to.set_terminal(from.terminal);
  to.set_function(from.function);
  to.set_active(from.active);
  to_proto(from.after, *to.mutable_after());
  to_proto(from.before, *to.mutable_before());
}

void fill(const StateChange& from, v1::Event& event) {
  auto& to = *event.mutable_state_change();
  to.set_from(to_proto(from.from));
  to.set_to(to_proto(from.to));
  to.set_cause(to_proto(from.cause));
}

void fill(const LinkChange& from, v1::Event& event) {
  auto& to = *event.mutable_link_change();
  to.set_to(to_proto(from.to));
  to.set_detail(from.detail);
}

void fill(const ConfigurationDrift& from, v1::Event& event) {
  event.mutable_configuration_drift()->set_text(from.text);
}

void fill(const FlightRecordWritten& from, v1::Event& event) {
  auto& to = *event.mutable_flight_record();
  to.set_bus(from.bus);
  to.set_name(from.name);
  to.set_reason(from.reason);
}

void fill(const LeaseChange& from, v1::Event& event) {
  auto& to = *event.mutable_lease_change();
  to.set_kind(static_cast<v1::LeaseChangeKind>(std::to_underlying(from.what) + 1));  // 0 is "unspecified"
  to.set_holder(from.holder);
  to.set_before(from.before);
}
static_assert(std::to_underlying(LeaseChange::What::taken) + 1 == v1::LEASE_CHANGE_KIND_TAKEN);

void fill(const ConfigurationReloaded& from, v1::Event& event) {
  auto& to = *event.mutable_configuration_reloaded();
  to.set_client(from.client);
  to.set_previous_revision(from.before);
  to.set_revision(from.revision);
  for (const auto& change : from.changes) to_proto(change, *to.add_changes());
}

void fill(const StopHoldChange& from, v1::Event& event) {
  auto& to = *event.mutable_stop_hold_change();
  to.set_kind(static_cast<v1::StopHoldChangeKind>(std::to_underlying(from.what) + 1));  // 0 is "unspecified"
  to.set_holder(from.hold.holder);
  to.set_request_id(from.hold.request_id);
  to.set_by(from.by);
}

void fill(const CommandChange& from, v1::Event& event) {
  to_proto(*from.command, *event.mutable_command_change()->mutable_command());
}

void fill(const AxisFault& from, v1::Event& event) {
  to_proto(from.cause, *event.mutable_axis_fault()->mutable_cause());
}

void fill(const KeptStateChange& from, v1::Event& event) {
  auto& to = *event.mutable_kept_state_change();
  for (const auto& conviction : from.convictions) to_proto(conviction, *to.add_convictions());
  to.set_accepted_by(from.accepted_by);
}

void fill(const InhibitChange& from, v1::Event& event) {
  auto& to = *event.mutable_inhibit_change();
  to.set_kind(static_cast<v1::InhibitChangeKind>(std::to_underlying(from.what) + 1));  // 0 is "unspecified"
  to.set_by(from.by);
}

void fill(const CertificateNotice& from, v1::Event& event) {
  auto& to = *event.mutable_certificate_notice();
  to.set_kind(
      static_cast<v1::CertificateNoticeKind>(std::to_underlying(from.what) + 1));  // 0 is "unspecified"
  to.set_path(from.path);
  if (from.expires != WallTime{}) to_proto(from.expires, *to.mutable_expires());
  to.set_text(from.text);
}

void fill(const EepromWritten& from, v1::Event& event) {
  auto& to = *event.mutable_eeprom_written();
  to.set_registers(from.registers);
  to.set_total(from.total);
}
static_assert(std::to_underlying(CertificateNotice::What::not_replaced) + 1 ==
              v1::CERTIFICATE_NOTICE_KIND_NOT_REPLACED);
static_assert(std::to_underlying(InhibitChange::What::not_durable) + 1 ==
              v1::INHIBIT_CHANGE_KIND_NOT_DURABLE);
static_assert(std::to_underlying(StopHoldChange::What::not_durable) + 1 ==
              v1::STOP_HOLD_CHANGE_KIND_NOT_DURABLE);

}  // namespace

v1::EventKind kind_of(const Event& event) {
  struct Kind {
    v1::EventKind operator()(const TerminalEdge&) const { return v1::EVENT_KIND_TERMINAL_EDGE; }
    v1::EventKind operator()(const StateChange&) const { return v1::EVENT_KIND_STATE_CHANGE; }
    v1::EventKind operator()(const LinkChange&) const { return v1::EVENT_KIND_LINK_CHANGE; }
    v1::EventKind operator()(const ConfigurationDrift&) const { return v1::EVENT_KIND_CONFIGURATION_DRIFT; }
    v1::EventKind operator()(const FlightRecordWritten&) const { return v1::EVENT_KIND_FLIGHT_RECORD; }
    v1::EventKind operator()(const LeaseChange&) const { return v1::EVENT_KIND_LEASE_CHANGE; }
    v1::EventKind operator()(const ConfigurationReloaded&) const {
      return v1::EVENT_KIND_CONFIGURATION_RELOADED;
    }
    v1::EventKind operator()(const StopHoldChange&) const { return v1::EVENT_KIND_STOP_HOLD_CHANGE; }
    v1::EventKind operator()(const CommandChange&) const { return v1::EVENT_KIND_COMMAND_CHANGE; }
    v1::EventKind operator()(const AxisFault&) const { return v1::EVENT_KIND_AXIS_FAULT; }
    v1::EventKind operator()(const KeptStateChange&) const { return v1::EVENT_KIND_KEPT_STATE_CHANGE; }
    v1::EventKind operator()(const InhibitChange&) const { return v1::EVENT_KIND_INHIBIT_CHANGE; }
    v1::EventKind operator()(const CertificateNotice&) const { return v1::EVENT_KIND_CERTIFICATE_NOTICE; }
    v1::EventKind operator()(const EepromWritten&) const { return v1::EVENT_KIND_EEPROM_WRITTEN; }
  };
  return std::visit(Kind{}, event.content);
}

void to_proto(const Event& from, v1::Event& to) {
  to.set_sequence(from.sequence);
  to_proto(from.at, *to.mutable_at());
  to.set_axis(from.axis);
  std::visit([&to](const auto& content) { fill(content, to); }, from.content);
}

}  // namespace axisd::server
