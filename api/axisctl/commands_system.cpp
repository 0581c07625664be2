// buses, info: the machine as a whole.
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "api/axisctl/format.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/table.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/bus_service.grpc.pb.h"
#include "axisd/v1/system_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

Cell bus_state(const v1::Bus& bus) {
  if (!bus.open()) return {bus.has_error() ? "closed: " + describe(bus.error()) : "closed", Colour::red};
  return bus.simulated() ? "open, simulated" : "open";
}

void buses(Invocation& invocation) {
  const auto response =
      invocation.client().call(&v1::BusService::Stub::ListBuses, v1::ListBusesRequest(), std::string_view());
  if (invocation.json) return print_line(json(response));
  Table table({"BUS", "PORT", "BAUD", "TRANSACTIONS", "TIMEOUTS", "CORRUPT", "EXCEPTIONS", "FOREIGN",
               "EXPIRED", "SUPERSEDED", "I/O ERRORS", "STATE"},
              {2, 3, 4, 5, 6, 7, 8, 9, 10});
  for (const auto& bus : response.buses())
    table.add({bus.name(), bus.port(), std::to_string(bus.baud()), std::to_string(bus.transactions()),
               std::to_string(bus.timeouts()), std::to_string(bus.corrupt_replies()),
               std::to_string(bus.exceptions()), std::to_string(bus.foreign_frames()),
               std::to_string(bus.dropped_expired()), std::to_string(bus.dropped_superseded()),
               std::to_string(bus.io_errors()), bus_state(bus)});
  table.print(use_colour());
}

void info(Invocation& invocation) {
  const auto response =
      invocation.client().call(&v1::SystemService::Stub::GetInfo, v1::GetInfoRequest(), std::string_view());
  if (invocation.json) return print_line(json(response));
  const std::string held =
      response.inhibited()
          ? fmt::format("all axes stopped{}{}; 'axisctl release-stop --all' ends it",
                        response.inhibited_by().empty() ? "" : " by ", response.inhibited_by())
          : "permitted";
  print(fmt::format(
      "machine:    {}\naxisd:      {}\naxisctl:    {}\nserver:     {}\ninstance:   {}\nmotion:     {}\n",
      response.machine(), response.version(), AXISD_VERSION, invocation.connection.server,
      response.instance_id(),
      coloured(held, response.inhibited() ? Colour::yellow : Colour::none, use_colour())));
}

}  // namespace

void add_system_commands(CLI::App& app, Invocation& invocation) {
  app.add_subcommand("buses", "The buses and what went over them")->callback([&invocation] {
    buses(invocation);
  });
  app.add_subcommand("info", "Machine, versions, whether motion is permitted")->callback([&invocation] {
    info(invocation);
  });
}

}  // namespace axisd::axisctl
