#include "api/axisctl/audit_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <cstdint>
#include <optional>

#include "api/axisctl/error.hpp"
#include "api/axisctl/event_text.hpp"
#include "api/axisctl/format.hpp"

namespace axisd::axisctl {
namespace {

using google::protobuf::util::TimeUtil;

/// Where to, how far, or how fast; with a space before it.
std::string target_text(const v1::MotionValues& asked) {
  if (asked.has_position()) return fmt::format(" {:g}", asked.position());
  if (asked.has_distance()) return fmt::format(" {:+g}", asked.distance());
  return asked.has_velocity() ? fmt::format(" {:g}/s", asked.velocity()) : "";
}

std::string left_out_text(std::uint64_t left_out) {
  return left_out == 0 ? "" : fmt::format(" ({} more before it have no record)", left_out);
}

std::string text_of(const v1::RefusedCommand& refused) {
  const auto& command = refused.command();
  return fmt::format("refused: {}{}: {}{}", command_kind(command), target_text(command.asked()),
                     describe(command.cause(), command.axis()), left_out_text(refused.left_out()));
}

std::string text_of(const v1::DeniedCall& denied) {
  return fmt::format("refused: {}{}", describe(denied.error()), left_out_text(denied.left_out()));
}

std::string text_of(const v1::AuditedParameter& parameter) {
  const auto value = [](bool known, std::int64_t number) { return known ? std::to_string(number) : "?"; };
  const auto name = parameter.name().empty() ? address_text(parameter.address()) : parameter.name();
  if (!parameter.has_before() && !parameter.has_after())
    return fmt::format("{} = {}", name, parameter.asked());
  return fmt::format("{} {} -> {}", name, value(parameter.has_before(), parameter.before()),
                     value(parameter.has_after(), parameter.after()));
}

std::string text_of(const v1::AuditedCall& call) {
  auto text = call.text();
  for (const auto& parameter : call.parameters())
    text += (&parameter == &call.parameters(0) ? ": " : ", ") + text_of(parameter);
  switch (call.phase()) {
    case v1::AUDITED_CALL_PHASE_ASKED:
      return "asked: " + text;
    case v1::AUDITED_CALL_PHASE_DONE:
      return "done: " + text;
    default:
      return fmt::format("failed: {}: {}", text, describe(call.error()));
  }
}

std::string text_of(const v1::RecoveredCommand& recovered) {
  return fmt::format("{} by {} (from the command journal: its start {} sent)",
                     command_line(recovered.command(), ""), recovered.command().client(),
                     recovered.sent() ? "may have been" : "was not");
}

/// `client`: who is shown in front already.
std::string text_of(const v1::Event& event, const std::string& client) {
  const auto& command = event.command_change().command();
  return event.has_command_change() && command.client() == client ? command_line(command, "")
                                                                  : axisctl::content_text(event);
}

std::string text_of(const v1::DaemonRun& run) {
  return fmt::format("axisd {} {} (start {})", run.version(),
                     run.kind() == v1::DAEMON_RUN_KIND_BEGAN ? "began" : "ended", run.start_count());
}

std::string content_text(const v1::AuditRecord& record) {
  switch (record.content_case()) {
    case v1::AuditRecord::kEvent:
      return text_of(record.event(), record.client());
    case v1::AuditRecord::kRefused:
      return text_of(record.refused());
    case v1::AuditRecord::kCall:
      return text_of(record.call());
    case v1::AuditRecord::kDenied:
      return text_of(record.denied());
    case v1::AuditRecord::kRecovered:
      return text_of(record.recovered());
    case v1::AuditRecord::kRun:
      return text_of(record.run());
    case v1::AuditRecord::kGap:
      return fmt::format("{} {}", record.gap().left_out(),
                         record.client().empty() ? "records are missing: the disk did not take them"
                                                 : "more stops before have no record: there were too many");
    case v1::AuditRecord::CONTENT_NOT_SET:
      break;
  }
  return "a record that this axisctl does not know";
}

/// What it concerns: an axis, a group, a bus, or the machine.
std::string target_of(const v1::AuditRecord& record) {
  if (!record.axis().empty() && record.group().empty()) return record.axis();
  if (!record.group().empty()) return "group " + record.group();
  return record.bus().empty() ? "-" : "bus " + record.bus();
}

std::string kind_name(v1::AuditKind kind) {
  auto name = lower_word(v1::AuditKind_Name(kind), "AUDIT_KIND_");
  std::ranges::replace(name, ' ', '-');
  return name;
}

}  // namespace

std::string audit_line(const v1::AuditRecord& record) {
  const auto at = TimeUtil::MillisecondsToTimestamp(TimeUtil::TimestampToMilliseconds(record.at()));
  return fmt::format("{}  {}  {}  {}  {}", TimeUtil::ToString(at), record.number(), target_of(record),
                     record.client().empty() ? "-" : record.client(), content_text(record));
}

std::vector<std::string> audit_kinds() {
  std::vector<std::string> names;
  for (int number = v1::AuditKind_MIN + 1; number <= v1::AuditKind_MAX; ++number)
    names.push_back(kind_name(static_cast<v1::AuditKind>(number)));
  return names;
}

v1::AuditKind parse_audit_kind(std::string_view text) {
  for (int number = v1::AuditKind_MIN + 1; number <= v1::AuditKind_MAX; ++number)
    if (const auto kind = static_cast<v1::AuditKind>(number); kind_name(kind) == text) return kind;
  throw Failure(ExitCode::usage, fmt::format("--kind: '{}' is no kind of record; permitted: {}", text,
                                             fmt::join(audit_kinds(), ", ")));
}

}  // namespace axisd::axisctl
