#include "api/server/audit_convert.hpp"

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <cctype>
#include <utility>
#include <variant>

#include "api/server/convert.hpp"
#include "api/server/event_convert.hpp"
#include "api/server/json_text.hpp"

namespace axisd::server {
namespace {

namespace json = google::protobuf::util;

/// "AxisService.MoveAbsolute".
std::string rpc_of(CommandKind kind) {
  std::string name;
  bool begins = true;
  for (const char c : to_string(kind)) {
    if (c != '_') name += begins ? static_cast<char>(std::toupper(static_cast<unsigned char>(c))) : c;
    begins = c == '_';
  }
  return fmt::format("{}.{}", kind == CommandKind::move_group ? "GroupService" : "AxisService", name);
}

void fill_origin(const CallOriginPtr& origin, v1::AuditRecord& to) {
  if (!origin) return;
  to.set_peer(origin->peer);
  if (origin->role) to.set_role(std::string(to_string(*origin->role)));
}

void fill_head(const Command& command, v1::AuditRecord& to) {
  to.set_client(command.client);
  to.set_axis(command.axis);
  to.set_rpc(rpc_of(command.kind));
  to.set_request_id(command.request_id);
  to.set_lease_token(command.lease_token);
  fill_origin(command.origin, to);
}

/// Who it was that did it, and of what kind the record is.
struct Head {
  v1::AuditRecord& to;
  void operator()(const CommandChange& change) const {
    to.set_kind(v1::AUDIT_KIND_COMMAND);
    fill_head(*change.command, to);
  }
  void operator()(const AxisFault&) const { to.set_kind(v1::AUDIT_KIND_FAULT); }
  void operator()(const LeaseChange& change) const {
    to.set_kind(v1::AUDIT_KIND_LEASE);
    to.set_client(change.holder.empty() ? change.before : change.holder);
  }
  void operator()(const StopHoldChange& change) const {
    to.set_kind(v1::AUDIT_KIND_STOP_HOLD);
    to.set_client(change.by.empty() ? change.hold.holder : change.by);
    to.set_request_id(change.hold.request_id);
  }
  void operator()(const InhibitChange& change) const {
    to.set_kind(v1::AUDIT_KIND_INHIBIT);
    to.set_client(change.by);
    if (change.what == InhibitChange::What::latched) to.set_rpc("SystemService.StopAll");
    if (change.what == InhibitChange::What::released) to.set_rpc("SystemService.ReleaseStopAll");
  }
  void operator()(const ConfigurationReloaded& change) const {
    to.set_kind(v1::AUDIT_KIND_CONFIGURATION);
    to.set_client(change.client);
    to.set_rpc("SystemService.ReloadConfig");
  }
  void operator()(const KeptStateChange& change) const {
    to.set_kind(v1::AUDIT_KIND_STATE);
    to.set_client(change.accepted_by);
    if (!change.accepted_by.empty()) to.set_rpc("SystemService.AcceptState");
  }
  void operator()(const EepromWritten&) const { to.set_kind(v1::AUDIT_KIND_EEPROM); }
  template <class Other>
  void operator()(const Other&) const {}
};

struct Fill {
  v1::AuditRecord& to;
  void operator()(const Event& event) const {
    to.set_axis(event.axis);
    std::visit(Head{to}, event.content);
    to_proto(event, *to.mutable_event());
  }
  void operator()(const RefusedCommand& refused) const {
    to.set_kind(v1::AUDIT_KIND_REFUSAL);
    fill_head(refused.command, to);
    to.set_group(refused.group);
    to_proto(refused.command, *to.mutable_refused()->mutable_command());
    to.mutable_refused()->set_left_out(refused.left_out);
  }
  void operator()(const DeniedCall& denied) const {
    to.set_kind(v1::AUDIT_KIND_REFUSAL);
    to.set_client(denied.client);
    to.set_axis(denied.axis);
    to.set_group(denied.group);
    to.set_bus(denied.bus);
    to.set_rpc(denied.rpc);
    fill_origin(denied.origin, to);
    to_proto(denied.error, *to.mutable_denied()->mutable_error());
    to.mutable_denied()->set_left_out(denied.left_out);
  }
  void operator()(const RecoveredCommand& recovered) const {
    to.set_kind(v1::AUDIT_KIND_COMMAND);
    fill_head(recovered.command, to);
    to_proto(recovered.command, *to.mutable_recovered()->mutable_command());
    to.mutable_recovered()->set_sent(recovered.sent);
  }
  void operator()(const AuditedCall& call) const {
    to.set_kind(v1::AUDIT_KIND_CALL);
    to.set_client(call.client);
    to.set_axis(call.axis);
    to.set_bus(call.bus);
    to.set_rpc(call.rpc);
    to.set_lease_token(call.lease_token);
    fill_origin(call.origin, to);
    auto& entry = *to.mutable_call();
    entry.set_phase(static_cast<v1::AuditedCallPhase>(std::to_underlying(call.phase) + 1));
    entry.set_text(call.text);
    for (const auto& parameter : call.parameters) {
      auto& written = *entry.add_parameters();
      written.set_name(parameter.name);
      written.set_address(parameter.address);
      written.set_asked(parameter.asked);
      if (parameter.before) written.set_before(*parameter.before);
      if (parameter.after) written.set_after(*parameter.after);
    }
    if (call.error) to_proto(*call.error, *entry.mutable_error());
  }
  void operator()(const DaemonRun& run) const {
    to.set_kind(v1::AUDIT_KIND_DAEMON);
    auto& entry = *to.mutable_run();
    entry.set_kind(static_cast<v1::DaemonRunKind>(std::to_underlying(run.what) + 1));
    entry.set_version(run.version);
    entry.set_start_count(run.start_count);
  }
  void operator()(const AuditGap& gap) const {
    to.set_kind(v1::AUDIT_KIND_GAP);
    to.set_client(gap.client);
    to.mutable_gap()->set_left_out(gap.left_out);
  }
};
static_assert(std::to_underlying(AuditedCall::Phase::failed) + 1 == v1::AUDITED_CALL_PHASE_FAILED);
static_assert(std::to_underlying(DaemonRun::What::ended) + 1 == v1::DAEMON_RUN_KIND_ENDED);

}  // namespace

void to_proto(const AuditEntry& from, v1::AuditRecord& to) {
  to_proto(from.at, *to.mutable_at());
  to_proto(from.uptime, *to.mutable_uptime());
  std::visit(Fill{to}, from.content);
}

std::string audit_line(const v1::AuditRecord& record) {
  if (auto line = json_text(record)) return *std::move(line);
  // A time that no protobuf has, or a text that is no UTF-8: the number goes on, and it is seen that one is
  // missing.
  return fmt::format(R"({{"number":"{}","kind":"AUDIT_KIND_GAP","gap":{{"left_out":"1"}}}})",
                     record.number());
}

std::optional<v1::AuditRecord> audit_record(std::string_view line) {
  v1::AuditRecord record;
  json::JsonParseOptions options;
  options.ignore_unknown_fields = true;
  const google::protobuf::StringPiece text(line.data(), line.size());
  if (!json::JsonStringToMessage(text, &record, options).ok()) return std::nullopt;
  return record;
}

std::optional<ToldCommand> told_command(std::string_view line) {
  constexpr std::string_view before = "\"command\":{\"id\":\"";
  const auto found = line.find(before);
  if (found == std::string_view::npos) return std::nullopt;
  const auto rest = line.substr(found + before.size());
  return ToldCommand{.id = std::string(rest.substr(0, rest.find('"'))),
                     .ended = rest.find("\"ended_at\":\"") != std::string_view::npos};
}

bool AuditFilter::passes(const v1::AuditRecord& record) const {
  const auto among = [](const auto& wanted, const auto& value) {
    return wanted.empty() || std::find(wanted.begin(), wanted.end(), value) != wanted.end();
  };
  const bool of_group = !record.group().empty() && among(request_.axes(), record.group());
  return (of_group || among(request_.axes(), record.axis())) && among(request_.clients(), record.client()) &&
         among(request_.kinds(), static_cast<int>(record.kind())) &&
         (!request_.has_since() || record.at() >= request_.since());
}

}  // namespace axisd::server
