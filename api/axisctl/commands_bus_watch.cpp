// bus statistics|records|record|record-now: what went over the buses.
#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "api/axisctl/bus_commands.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/statistics_view.hpp"
#include "api/axisctl/table.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/bus_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

using Stub = v1::BusService::Stub;

void statistics(Invocation& invocation, const std::string& bus) {
  v1::GetBusStatisticsRequest request;
  request.set_bus(bus);
  const auto response = invocation.client().call(&Stub::GetBusStatistics, request, bus);
  if (invocation.json) return print_line(json(response));
  for (const auto& one : response.buses()) {
    if (&one != &response.buses(0)) print("\n");
    print_line(load_line(one));
    const bool network = one.kind() == v1::BUS_KIND_CANOPEN;
    if (!network) class_table(one).print(use_colour());
    if (one.nodes().empty()) continue;
    if (!network) print("\n");
    (network ? network_node_table(one) : line_node_table(one)).print(use_colour());
  }
}

void records(Invocation& invocation) {
  const auto response =
      invocation.client().call(&Stub::ListFlightRecords, v1::ListFlightRecordsRequest(), std::string_view());
  if (invocation.json) return print_line(json(response));
  Table table({"RECORD", "BUS", "WRITTEN", "BYTES", "REASON"}, {3});
  using google::protobuf::util::TimeUtil;
  for (const auto& record : response.records())
    table.add({record.name(), record.bus(),
               TimeUtil::ToString(TimeUtil::SecondsToTimestamp(record.written_at().seconds())),
               std::to_string(record.size()), record.reason()});
  table.print(use_colour());
}

void record(Invocation& invocation, const std::string& name) {
  v1::GetFlightRecordRequest request;
  request.set_name(name);
  const auto response = invocation.client().call(&Stub::GetFlightRecord, request, std::string_view());
  invocation.json ? print_line(json(response)) : print(response.text());
}

void record_now(Invocation& invocation, const std::string& bus) {
  v1::WriteFlightRecordRequest request;
  request.set_bus(bus);
  const auto response = invocation.client().call(&Stub::WriteFlightRecord, request, bus);
  print_line(invocation.json ? json(response) : response.name());
}

}  // namespace

void add_watch_commands(CLI::App& bus, Invocation& invocation) {
  const auto add = [&](const char* name, const char* help, const char* argument, const char* argument_help,
                       void (*action)(Invocation&, const std::string&)) {
    auto* command = bus.add_subcommand(name, help);
    const auto value = std::make_shared<std::string>();
    auto* option = command->add_option(argument, *value, argument_help);
    command->callback([&invocation, value, action] { action(invocation, *value); });
    return option;
  };
  add("statistics", "Load, latencies, errors and drops of a bus, or of every bus", "BUS", "Name of the bus",
      statistics);
  bus.add_subcommand("records", "Flight records: the newest frames of a bus, written after each fault")
      ->callback([&invocation] { records(invocation); });
  add("record", "The text of one flight record", "RECORD", "Its name", record)->required();
  add("record-now", "Write a flight record now", "BUS", "Name of the bus", record_now)->required();
}

}  // namespace axisd::axisctl
