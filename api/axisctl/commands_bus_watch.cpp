// bus statistics|records|record|record-now: what went over the buses.
#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>

#include "api/axisctl/bus_commands.hpp"
#include "api/axisctl/duration.hpp"
#include "api/axisctl/follow.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/live_view.hpp"
#include "api/axisctl/quantity.hpp"
#include "api/axisctl/statistics_view.hpp"
#include "api/axisctl/table.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/bus_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

using Stub = v1::BusService::Stub;

struct StatisticsArguments {
  std::string bus;
  bool watch = false;
  std::string period = "1s";
  std::uint64_t count = 0;  ///< 0: without end
};

void statistics(Invocation& invocation, const std::string& bus) {
  v1::GetBusStatisticsRequest request;
  request.set_bus(bus);
  const auto response = invocation.client().call(&Stub::GetBusStatistics, request, bus);
  if (invocation.json) return print_line(json(response));
  for (const auto& line : statistics_lines(response.buses(), use_colour(), output_columns(), TooWide::fold))
    print_line(line);
}

void watch_statistics(Invocation& invocation, const StatisticsArguments& arguments) {
  v1::WatchBusStatisticsRequest request;
  request.set_bus(arguments.bus);
  set(*request.mutable_period(), parse_duration(arguments.period, "--period"));
  std::optional<LiveView> live;
  if (!invocation.json && is_terminal(STDOUT_FILENO)) live.emplace();
  std::uint64_t seen = 0;
  follow<v1::WatchBusStatisticsResponse>(
      invocation.client(), &Stub::WatchBusStatistics, request, arguments.bus,
      [&](const v1::WatchBusStatisticsResponse& tick) {
        if (invocation.json) {
          print_line(json(tick));
        } else if (live) {
          live->show(statistics_lines(tick.buses(), use_colour(), terminal_columns()));
        } else {
          for (const auto& line : statistics_lines(tick.buses(), false)) print_line(line);
          print_line("");
        }
        return ++seen != arguments.count;
      });
}

void add_statistics_command(CLI::App& bus, Invocation& invocation) {
  auto* command =
      bus.add_subcommand("statistics", "Load, latencies, errors and drops of a bus, or of every bus");
  const auto arguments = std::make_shared<StatisticsArguments>();
  command->add_option("BUS", arguments->bus, "Name of the bus");
  auto* watch =
      command->add_flag("--watch", arguments->watch,
                        "Again and again until Ctrl-C: in place on a terminal, else one below the other");
  command->add_option("--period", arguments->period, "Time between them, 100ms to 60s")
      ->type_name("TIME")
      ->needs(watch)
      ->capture_default_str();
  command->add_option("--count", arguments->count, "End after so many")->type_name("N")->needs(watch);
  command->callback([&invocation, arguments] {
    arguments->watch ? watch_statistics(invocation, *arguments) : statistics(invocation, arguments->bus);
  });
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
  add_statistics_command(bus, invocation);
  bus.add_subcommand("records", "Flight records: the newest frames of a bus, written after each fault")
      ->callback([&invocation] { records(invocation); });
  add("record", "The text of one flight record", "RECORD", "Its name", record)->required();
  add("record-now", "Write a flight record now", "BUS", "Name of the bus", record_now)->required();
}

}  // namespace axisd::axisctl
