// audit, report: who asked for what, and what became of it.
#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "api/axisctl/audit_text.hpp"
#include "api/axisctl/axis_report.hpp"
#include "api/axisctl/duration.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/interrupt.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/quantity.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/audit_service.grpc.pb.h"
#include "axisd/v1/axis_service.grpc.pb.h"
#include "axisd/v1/drive_service.grpc.pb.h"
#include "axisd/v1/group_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

using google::protobuf::util::TimeUtil;

/// Between two looks at what is new.
constexpr std::chrono::milliseconds look_again{500};
constexpr std::uint32_t page_size = 500;

struct Arguments {
  std::vector<std::string> axes, clients, kinds;
  std::string since;
  std::uint64_t last = 0;  ///< 0: all
  bool follow = false;
};

/// Of the record in front of the newest `count`.
std::uint64_t before_last(Client& client, std::uint64_t count) {
  v1::ListAuditRequest request;
  request.set_after_number(std::numeric_limits<std::uint64_t>::max());
  const auto newest = client.call(&v1::AuditService::Stub::ListAudit, request, std::string_view()).newest();
  return newest - std::min(newest, count);
}

void set_since(v1::ListAuditRequest& request, const std::string& since) {
  if (since.empty()) return;
  const auto when = parse_since(since, "--since");
  if (when.number)
    request.set_after_number(*when.number);
  else
    set_ahead(*request.mutable_since(), -when.ago);
}

/// Gives all records to `take`, page by page, up to the newest. Where the next look goes on is in `request`.
void read(Client& client, v1::ListAuditRequest& request,
          const std::function<void(const v1::AuditRecord&)>& take) {
  request.set_limit(page_size);
  for (;;) {
    const auto response = client.call(&v1::AuditService::Stub::ListAudit, request, std::string_view());
    for (const auto& record : response.records()) take(record);
    // A daemon that was given another state directory counts anew.
    request.set_after_number(response.cursor());
    if (response.cursor() >= response.newest()) return;
  }
}

/// "; 'feedr' is no axis or group now" for the first of these names that is none; nothing: each is one.
std::string not_there_now(Client& client, const std::vector<std::string>& names) {
  if (names.empty()) return {};
  std::set<std::string> known;
  for (const auto& axis :
       client.call(&v1::AxisService::Stub::ListAxes, v1::ListAxesRequest(), std::string_view()).axes())
    known.insert(axis.axis());
  for (const auto& group :
       client.call(&v1::GroupService::Stub::ListGroups, v1::ListGroupsRequest(), std::string_view()).groups())
    known.insert(group.name());
  for (const auto& name : names)
    if (!known.contains(name)) return fmt::format("; '{}' is no axis or group now", name);
  return {};
}

void audit(Invocation& invocation, const Arguments& arguments) {
  v1::ListAuditRequest request;
  for (const auto& axis : arguments.axes) request.add_axes(axis);
  for (const auto& client : arguments.clients) request.add_clients(client);
  for (const auto& kind : arguments.kinds) request.add_kinds(parse_audit_kind(kind));
  set_since(request, arguments.since);
  auto& client = invocation.client();
  if (arguments.last > 0) request.set_after_number(before_last(client, arguments.last));
  bool any = false;
  const auto show = [&invocation, &any](const v1::AuditRecord& record) {
    any = true;
    print_line(invocation.json ? json(record) : audit_line(record));
  };
  if (!arguments.follow) {
    read(client, request, show);
    if (!any && !invocation.json)
      print_line("the audit has no such record" + not_there_now(client, arguments.axes));
    return;
  }
  const Interrupt interrupt([] {});
  do read(client, request, show);
  while (!interrupt.wait_for(look_again));
}

void report(Invocation& invocation, const std::string& axis, const std::string& since) {
  const auto unit = invocation.state(axis).unit();
  v1::ListAuditRequest request;
  request.add_axes(axis);
  set_since(request, since);
  AxisReport counted;
  std::optional<v1::AuditRecord> first;
  read(invocation.client(), request, [&](const v1::AuditRecord& record) {
    if (!first) first = record;
    counted.add(record);
  });
  v1::GetDriveRequest drive;
  drive.set_axis(axis);
  const auto writes =
      invocation.client().call(&v1::DriveService::Stub::GetDrive, drive, axis).eeprom_writes();
  if (invocation.json) {
    auto values = counted.values();
    (*values.mutable_fields())["axis"].set_string_value(axis);
    (*values.mutable_fields())["eeprom_writes_total"].set_number_value(static_cast<double>(writes));
    return print_line(json(values));
  }
  for (const auto& line : counted.lines(unit)) print_line(line);
  print_line(fmt::format("{:<18}{} since the axis was first configured here", "", writes));
  print_line(first ? "counted since " + TimeUtil::ToString(first->at())
                   : "the audit has no record of the axis");
}

void add_audit(CLI::App& app, Invocation& invocation) {
  auto* command = app.add_subcommand(
      "audit",
      "Who asked for what and what became of it: commands, refusals, changes of parameters, faults, "
      "leases, held stops, StopAll, configurations, over restarts of the daemon");
  const auto arguments = std::make_shared<Arguments>();
  command
      ->add_option("AXIS", arguments->axes,
                   "Names of axes and groups, with spaces or commas between; none: all, and what concerns a "
                   "bus or the "
                   "machine")
      ->delimiter(',');
  command
      ->add_option(
          "--kind", arguments->kinds,
          "command, refusal, call, fault, lease, stop-hold, inhibit, configuration, state, daemon, gap, "
          "eeprom; several with commas")
      ->type_name("KIND,...")
      ->delimiter(',');
  command
      ->add_option("--client", arguments->clients,
                   "Only of this identity, as it is shown; several with commas")
      ->type_name("CLIENT,...")
      ->delimiter(',');
  auto* since = command
                    ->add_option("--since", arguments->since,
                                 "Only records behind a number, or younger than a time (10min, 8h, 7d)")
                    ->type_name("WHEN");
  command->add_option("-n,--last", arguments->last, "Look at the newest so many records only")
      ->check(CLI::Validator(CLI::PositiveNumber).description(""))
      ->excludes(since);
  command->add_flag("--follow", arguments->follow, "Go on with new records until Ctrl-C");
  command->footer(R"(
Examples:
  axisctl audit feeder --since 10min
  axisctl audit --kind refusal,call --client hmi-1
  axisctl audit --last 20 --follow)");
  command->callback([&invocation, arguments] { audit(invocation, *arguments); });
}

}  // namespace

void add_audit_commands(CLI::App& app, Invocation& invocation) {
  add_audit(app, invocation);
  auto* command = app.add_subcommand(
      "report", "What an axis did, counted from the audit: motions, distance, stops, faults, EEPROM writes");
  const auto axis = std::make_shared<std::string>();
  const auto since = std::make_shared<std::string>();
  command->add_option("AXIS", *axis, "Name of the axis")->required();
  command
      ->add_option("--since", *since,
                   "Only what is younger than a time (8h, 7d), or behind a record's number")
      ->type_name("WHEN");
  command->callback([&invocation, axis, since] { report(invocation, *axis, *since); });
}

}  // namespace axisd::axisctl
