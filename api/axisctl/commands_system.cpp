// buses, info, whoami, log-level: the machine as a whole.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "api/axisctl/bus_commands.hpp"
#include "api/axisctl/cell_view.hpp"
#include "api/axisctl/error.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/cell/v1/cell_service.grpc.pb.h"
#include "axisd/v1/system_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

/// In the order of the contract.
std::vector<std::string> log_levels() { return {"trace", "debug", "info", "warn", "error"}; }
static_assert(v1::LOG_LEVEL_TRACE == 1 && v1::LOG_LEVEL_ERROR == 5);

v1::GetInfoResponse ask(Invocation& invocation) {
  return invocation.client().call(&v1::SystemService::Stub::GetInfo, v1::GetInfoRequest(),
                                  std::string_view());
}

/// "operator; viewer on feeder".
std::string roles_of(const v1::GetInfoResponse& response) {
  const auto name = [](v1::Role role) { return lower_word(v1::Role_Name(role), "ROLE_"); };
  if (response.client().empty()) return "not known: this daemon does not tell";
  auto text = name(response.role());
  for (const auto& each : response.axis_roles())
    text += fmt::format("; {} on {}", name(each.role()), each.axis());
  return text;
}

void who_am_i(Invocation& invocation) {
  const auto response = ask(invocation);
  if (invocation.json) return print_line(json(response));
  print(fmt::format("client:     {}\nidentity:   {}\nrole:       {}\n", response.client(),
                    response.identity(), roles_of(response)));
  const auto& spoken_for = invocation.connection.speaks_for;
  // Of whom a delegate speaks for the client is "anna via web".
  if (!spoken_for.empty() && response.client() == response.identity())
    print_line(
        coloured(fmt::format("--as {} is not heeded: {} may not speak for others, or what it says is not "
                             "usable; access: delegates of the configuration says who may",
                             spoken_for, response.identity()),
                 Colour::yellow, use_colour()));
}

/// What keeps all axes from moving, and what ends it; empty: nothing does.
std::string what_holds(const v1::GetInfoResponse& response) {
  std::vector<std::string> held;
  if (response.inhibited())
    held.push_back(fmt::format("all axes stopped{}{}; 'axisctl release-stop --all' ends it",
                               response.inhibited_by().empty() ? "" : " by ", response.inhibited_by()));
  if (!response.state_unaccepted().empty())
    held.push_back(fmt::format("waits until the state is accepted ('axisctl state accept'): {}",
                               response.state_unaccepted()));
  if (response.has_storage_error())
    held.push_back("nothing new is started: " + describe(response.storage_error()));
  return fmt::format("{}", fmt::join(held, "; "));
}

/// Of a cell and of the entrance that is asked.
void cell_info(Invocation& invocation) {
  const auto response = invocation.client().call(&cell::v1::CellService::Stub::GetCell,
                                                 cell::v1::GetCellRequest(), std::string_view());
  if (invocation.json) return print_line(json(response));
  for (const auto& line : cell_details(response, use_colour())) print_line(line);
  print_line(fmt::format("axisctl:    {}", AXISD_VERSION));
}

void info(Invocation& invocation) {
  if (invocation.of_whole_cell()) return cell_info(invocation);
  const auto response = ask(invocation);
  if (invocation.json) return print_line(json(response));
  const auto held = what_holds(response);
  print(fmt::format(
      "machine:    {}\naxisd:      {}\naxisctl:    {}\nserver:     {}\ninstance:   {}\nyou:        {}, "
      "{}\nmotion:     {}\n",
      response.machine(), response.version(), AXISD_VERSION, invocation.connection.address(),
      response.instance_id(), response.client(), roles_of(response),
      held.empty() ? "permitted" : coloured(held, Colour::yellow, use_colour())));
}

/// Empty: only tells it.
void log_level(Invocation& invocation, const std::string& level) {
  v1::SetLogLevelRequest request;
  const auto levels = log_levels();
  if (const auto wanted = std::ranges::find(levels, level); wanted != levels.end())
    request.set_level(static_cast<v1::LogLevel>(wanted - levels.begin() + 1));
  const auto response =
      invocation.client().call(&v1::SystemService::Stub::SetLogLevel, request, std::string_view());
  if (invocation.json) return print_line(json(response));
  const auto name = [](v1::LogLevel one) { return lower_word(v1::LogLevel_Name(one), "LOG_LEVEL_"); };
  print_line(level.empty() ? name(response.level())
                           : fmt::format("{}; {} before, and at the next start of the daemon that of its "
                                         "command line",
                                         name(response.level()), name(response.previous())));
}

}  // namespace

void add_system_commands(CLI::App& app, Invocation& invocation) {
  app.add_subcommand("buses", "The buses and what went over them")->callback([&invocation] {
    list_buses(invocation);
  });
  app.add_subcommand("info", "Machine, or cell, versions, who you are, whether motion is permitted")
      ->callback([&invocation] { info(invocation); });
  app.add_subcommand("whoami", "Who the daemon takes you for, and what you may do")->callback([&invocation] {
    who_am_i(invocation);
  });
  auto* level_command =
      app.add_subcommand("log-level", "How much the daemon writes into its log, until it ends");
  const auto level = std::make_shared<std::string>();
  level_command->add_option("LEVEL", *level, "None: only show it")->check(CLI::IsMember(log_levels()));
  level_command->callback([&invocation, level] { log_level(invocation, *level); });
}

}  // namespace axisd::axisctl
