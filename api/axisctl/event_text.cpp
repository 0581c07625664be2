#include "api/axisctl/event_text.hpp"

#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>

#include <algorithm>

#include "api/axisctl/error.hpp"
#include "api/axisctl/format.hpp"

namespace axisd::axisctl {
namespace {

using google::protobuf::util::TimeUtil;

std::string text_of(const v1::TerminalEdge& edge) {
  return fmt::format("{}{}{} {} (within {})", edge.terminal(), edge.function().empty() ? "" : " ",
                     edge.function(), edge.active() ? "on" : "off",
                     duration_text(seconds(edge.before() - edge.after())));
}

std::string text_of(const v1::StateChange& change) {
  const auto state = [](v1::State value) { return camel_word(v1::State_Name(value), "STATE_"); };
  std::string text = fmt::format("{} -> {}", state(change.from()), state(change.to()));
  if (change.cause() == v1::MOTION_CAUSE_TERMINAL) text += ", started by a terminal";
  if (change.cause() == v1::MOTION_CAUSE_UNKNOWN) text += ", started by nobody that is known";
  return text;
}

std::string text_of(const v1::LinkChange& change) {
  const auto link = lower_word(v1::LinkState_Name(change.to()), "LINK_STATE_");
  return change.detail().empty() ? link : fmt::format("{}: {}", link, change.detail());
}

std::string text_of(const v1::ConfigurationDrift& drift) {
  return drift.text().empty() ? "holds its configuration again" : "drift: " + drift.text();
}

std::string text_of(const v1::FlightRecordWritten& record) {
  return fmt::format("{}: flight record {}: {}", record.bus(), record.name(), record.reason());
}

std::string text_of(const v1::LeaseChange& change) {
  switch (change.kind()) {
    case v1::LEASE_CHANGE_KIND_ACQUIRED:
      return "leased by " + change.holder();
    case v1::LEASE_CHANGE_KIND_RELEASED:
      return "lease released by " + change.before();
    case v1::LEASE_CHANGE_KIND_EXPIRED:
      return fmt::format("lease of {} expired", change.before());
    case v1::LEASE_CHANGE_KIND_TAKEN:
      return change.holder().empty()
                 ? fmt::format("lease of {} ended: another of its axes was taken", change.before())
                 : fmt::format("lease taken by {} from {}", change.holder(), change.before());
    default:
      return "a change of the lease that this axisctl does not know";
  }
}

std::string text_of(const v1::ConfigurationReloaded& reloaded) {
  std::string text = fmt::format("configuration {} reloaded by {}", reloaded.revision(), reloaded.client());
  for (const auto& change : reloaded.changes())
    text += (&change == &reloaded.changes(0) ? ": " : "; ") + axisctl::text_of(change);
  return text;
}

std::string text_of(const v1::StopHoldChange& change) {
  const auto whose = change.holder() +
                     (change.request_id().empty() ? "" : fmt::format(" (request {})", change.request_id()));
  switch (change.kind()) {
    case v1::STOP_HOLD_CHANGE_KIND_HELD:
      return "stop held by " + whose;
    case v1::STOP_HOLD_CHANGE_KIND_RELEASED:
      return fmt::format("hold of {} released by {}", whose, change.by());
    case v1::STOP_HOLD_CHANGE_KIND_NOT_DURABLE:
      return fmt::format("hold of {} would not outlive a restart: the disk failed", whose);
    default:
      return "a change of a held stop that this axisctl does not know";
  }
}

std::string text_of(const v1::CommandChange& change) {
  const auto& command = change.command();
  return fmt::format("{} by {}", command_line(command, ""), command.client());
}

std::string text_of(const v1::AxisFault& fault) { return "fault: " + describe(fault.cause()); }

std::string text_of(const v1::KeptStateChange& change) {
  std::string text;
  for (const auto& conviction : change.convictions()) text += (text.empty() ? "" : "; ") + conviction.text();
  return change.accepted_by().empty() ? "motion waits until the state is accepted: " + text
                                      : fmt::format("state accepted by {}: {}", change.accepted_by(), text);
}

std::string text_of(const v1::InhibitChange& change) {
  switch (change.kind()) {
    case v1::INHIBIT_CHANGE_KIND_LATCHED:
      return fmt::format("StopAll by {}: motion is inhibited until it is released", change.by());
    case v1::INHIBIT_CHANGE_KIND_RELEASED:
      return "StopAll released by " + change.by();
    case v1::INHIBIT_CHANGE_KIND_STANDS:
      return fmt::format("the daemon was started, and StopAll by {} stands", change.by());
    case v1::INHIBIT_CHANGE_KIND_NOT_DURABLE:
      return fmt::format("StopAll by {} would not outlive a restart: the disk failed", change.by());
    default:
      return "a change of StopAll that this axisctl does not know";
  }
}

std::string text_of(const v1::CertificateNotice& notice) { return notice.text(); }

std::string text_of(const v1::EepromWritten& written) {
  return fmt::format("{} register{} saved to the drive's EEPROM, {} in all", written.registers(),
                     written.registers() == 1 ? "" : "s", written.total());
}

std::string kind_name(v1::EventKind kind) {
  auto name = lower_word(v1::EventKind_Name(kind), "EVENT_KIND_");
  std::ranges::replace(name, ' ', '-');
  return name;
}

}  // namespace

std::string content_text(const v1::Event& event) {
  switch (event.content_case()) {
    case v1::Event::kTerminalEdge:
      return text_of(event.terminal_edge());
    case v1::Event::kStateChange:
      return text_of(event.state_change());
    case v1::Event::kLinkChange:
      return text_of(event.link_change());
    case v1::Event::kConfigurationDrift:
      return text_of(event.configuration_drift());
    case v1::Event::kFlightRecord:
      return text_of(event.flight_record());
    case v1::Event::kLeaseChange:
      return text_of(event.lease_change());
    case v1::Event::kConfigurationReloaded:
      return text_of(event.configuration_reloaded());
    case v1::Event::kStopHoldChange:
      return text_of(event.stop_hold_change());
    case v1::Event::kCommandChange:
      return text_of(event.command_change());
    case v1::Event::kAxisFault:
      return text_of(event.axis_fault());
    case v1::Event::kKeptStateChange:
      return text_of(event.kept_state_change());
    case v1::Event::kInhibitChange:
      return text_of(event.inhibit_change());
    case v1::Event::kCertificateNotice:
      return text_of(event.certificate_notice());
    case v1::Event::kEepromWritten:
      return text_of(event.eeprom_written());
    case v1::Event::CONTENT_NOT_SET:
      break;
  }
  return "an event that this axisctl does not know";
}

std::string text_of(const v1::ConfigChange& change) {
  auto text = change.name().empty() ? change.section() : change.section() + "." + change.name();
  text += " " + lower_word(v1::ConfigChangeKind_Name(change.kind()), "CONFIG_CHANGE_KIND_");
  if (!change.keys().empty()) text += fmt::format(" ({})", fmt::join(change.keys(), ", "));
  return text;
}

std::string event_line(const v1::Event& event) {
  // Milliseconds: no bus is quicker.
  const auto at = TimeUtil::MillisecondsToTimestamp(TimeUtil::TimestampToMilliseconds(event.at()));
  return fmt::format("{}  {}  {}  {}", TimeUtil::ToString(at), event.sequence(),
                     event.axis().empty() ? "-" : event.axis(), content_text(event));
}

std::vector<std::string> event_kinds() {
  std::vector<std::string> names;
  for (int number = v1::EventKind_MIN + 1; number <= v1::EventKind_MAX; ++number)
    names.push_back(kind_name(static_cast<v1::EventKind>(number)));
  return names;
}

v1::EventKind parse_event_kind(std::string_view text) {
  for (int number = v1::EventKind_MIN + 1; number <= v1::EventKind_MAX; ++number) {
    const auto kind = static_cast<v1::EventKind>(number);
    const auto name = kind_name(kind);
    if (text == name || name.starts_with(fmt::format("{}-", text))) return kind;
  }
  throw Failure(ExitCode::usage,
                fmt::format("--kind: '{}' is no kind of event; permitted: terminal, state, link, "
                            "configuration (of a drive), configuration-reloaded, flight, lease, stop "
                            "(holds), command, axis-fault, kept-state, inhibit (StopAll), certificate, "
                            "eeprom",
                            text));
}

}  // namespace axisd::axisctl
