// events: what happened, in order.
#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "api/axisctl/cell_events.hpp"
#include "api/axisctl/duration.hpp"
#include "api/axisctl/event_text.hpp"
#include "api/axisctl/follow.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/quantity.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/event_service.grpc.pb.h"
#include "axisd/v1/system_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

struct Arguments {
  std::vector<std::string> axes, kinds;
  std::string since;
  bool follow = false;
};

/// The request, and the time before which events are not shown.
struct Query {
  v1::WatchEventsRequest request;
  google::protobuf::Timestamp from;
};

Query query_of(Invocation& invocation, const Arguments& arguments) {
  Query query;
  for (const auto& axis : arguments.axes) query.request.add_axes(axis);
  for (const auto& kind : arguments.kinds) query.request.add_kinds(parse_event_kind(kind));
  query.request.set_after_sequence(0);
  if (arguments.since == "now") {
    query.request.clear_after_sequence();
    return query;
  }
  if (arguments.since.empty()) return query;
  const auto when = parse_since(arguments.since, "--since");
  if (when.number) {
    query.request.set_instance_id(
        invocation.client()
            .call(&v1::SystemService::Stub::GetInfo, v1::GetInfoRequest(), std::string_view())
            .instance_id());
    query.request.set_after_sequence(*when.number);
  } else {
    set_ahead(query.from, -when.ago);
  }
  return query;
}

void show(const Invocation& invocation, const v1::WatchEventsResponse& batch,
          const google::protobuf::Timestamp& from) {
  if (batch.lost() > 0 && !invocation.json)
    print_line(fmt::format("({} earlier events are no longer kept)", batch.lost()));
  for (const auto& event : batch.events())
    if (event.at() >= from) print_line(invocation.json ? json(event) : event_line(event));
}

void events_of_cell(Invocation& invocation, const Arguments& arguments) {
  CellEventQuery query{.words = arguments.axes, .machines = {}, .from = {}, .follow = arguments.follow};
  query.of_cell = arguments.axes.empty() && arguments.kinds.empty();
  for (const auto& kind : arguments.kinds) {
    if (kind == "cell")
      query.of_cell = true;
    else
      query.machines.add_kinds(parse_event_kind(kind));
  }
  query.of_machines = arguments.kinds.empty() || !query.machines.kinds().empty();
  if (arguments.since != "now") query.machines.set_after_sequence(0);
  if (!arguments.since.empty() && arguments.since != "now") {
    const auto when = parse_since(arguments.since, "--since");
    if (when.number)
      throw Failure(ExitCode::usage,
                    "--since: each machine counts its own events; give a time, or --machine");
    set_ahead(query.from, -when.ago);
  }
  cell_events(invocation, query);
}

void events(Invocation& invocation, const Arguments& arguments) {
  if (invocation.of_whole_cell()) return events_of_cell(invocation, arguments);
  const auto query = query_of(invocation, arguments);
  follow<v1::WatchEventsResponse>(invocation.client(), &v1::EventService::Stub::WatchEvents, query.request,
                                  arguments.axes.size() == 1 ? arguments.axes.front() : "",
                                  [&](const v1::WatchEventsResponse& batch) {
                                    show(invocation, batch, query.from);
                                    return arguments.follow || batch.cursor() < batch.newest();
                                  });
}

}  // namespace

void add_event_commands(CLI::App& app, Invocation& invocation) {
  auto* command = app.add_subcommand(
      "events",
      "What happened: terminal edges, states, links, drift, flight records, "
      "leases, held stops, commands, faults, the kept state, StopAll, certificates, writes to "
      "EEPROMs");
  const auto arguments = std::make_shared<Arguments>();
  command
      ->add_option("AXIS", arguments->axes,
                   "Names of axes, with spaces or commas between, with --cell also of machines; none: all")
      ->delimiter(',');
  command
      ->add_option(
          "--kind", arguments->kinds,
          "terminal, state, link, configuration, configuration-reloaded, flight, lease, stop, command, "
          "axis-fault, kept-state, inhibit, certificate, eeprom, and with --cell cell; several with commas")
      ->type_name("KIND,...")
      ->delimiter(',');
  command->add_flag("--follow", arguments->follow, "Go on with new events until Ctrl-C");
  command
      ->add_option("--since", arguments->since,
                   "Only events after a sequence number, younger than a time (10min), or from now on (now)")
      ->type_name("WHEN");
  command->footer(R"(
Examples:
  axisctl events feeder --since 5min
  axisctl events --kind terminal --follow --since now)");
  command->callback([&invocation, arguments] { events(invocation, *arguments); });
}

}  // namespace axisd::axisctl
