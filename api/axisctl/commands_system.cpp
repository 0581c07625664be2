// buses, info: the machine as a whole.
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "api/axisctl/bus_commands.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/system_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

void info(Invocation& invocation) {
  const auto response =
      invocation.client().call(&v1::SystemService::Stub::GetInfo, v1::GetInfoRequest(), std::string_view());
  if (invocation.json) return print_line(json(response));
  const bool waits = !response.state_unaccepted().empty();
  std::string held = response.inhibited()
                         ? fmt::format("all axes stopped{}{}; 'axisctl release-stop --all' ends it",
                                       response.inhibited_by().empty() ? "" : " by ", response.inhibited_by())
                         : "permitted";
  if (waits) {
    if (!response.inhibited()) held.clear();
    held += fmt::format("{}waits until the state is accepted ('axisctl state accept'): {}",
                        held.empty() ? "" : "; ", response.state_unaccepted());
  }
  print(fmt::format(
      "machine:    {}\naxisd:      {}\naxisctl:    {}\nserver:     {}\ninstance:   {}\nmotion:     {}\n",
      response.machine(), response.version(), AXISD_VERSION, invocation.connection.server,
      response.instance_id(),
      coloured(held, response.inhibited() || waits ? Colour::yellow : Colour::none, use_colour())));
}

}  // namespace

void add_system_commands(CLI::App& app, Invocation& invocation) {
  app.add_subcommand("buses", "The buses and what went over them")->callback([&invocation] {
    list_buses(invocation);
  });
  app.add_subcommand("info", "Machine, versions, whether motion is permitted")->callback([&invocation] {
    info(invocation);
  });
}

}  // namespace axisd::axisctl
