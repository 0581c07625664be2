// budget: of a file without a daemon, or of the daemon, with what was seen there.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "api/axisctl/budget_view.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/terminal.hpp"
#include "api/budget/convert.hpp"
#include "axisd/v1/bus_service.grpc.pb.h"
#include "axisd/v1/group_service.grpc.pb.h"
#include "config/budget.hpp"

namespace axisd::axisctl {
namespace {

void print_tables(const v1::GetBudgetResponse& response, const v1::ListGroupsResponse& groups) {
  std::string text;
  for (const auto& budget : response.budgets())
    text += (text.empty() ? "" : "\n") + budget_text(budget, groups, use_colour(), output_columns());
  print(text);
}

v1::ListGroupsResponse groups_of(const config::Configuration& configuration) {
  v1::ListGroupsResponse response;
  for (const auto& from : configuration.groups) {
    auto& group = *response.add_groups();
    group.set_name(from.name);
    group.mutable_axes()->Assign(from.axes.begin(), from.axes.end());
  }
  return response;
}

void budget_of_file(Invocation& invocation, const std::string& path) {
  const auto result = config::load_file(path);
  const auto& configuration = result.configuration ? result.configuration : result.over_budget;
  if (configuration) {
    v1::GetBudgetResponse response;
    for (const auto& report : config::budgets(*configuration)) api::to_proto(report, *response.add_budgets());
    if (invocation.json)
      print_line(json(response));
    else
      print_tables(response, groups_of(*configuration));
  }
  if (!result.configuration) invocation.status = ExitCode::usage;
  for (const auto& diagnostic : result.diagnostics) fmt::print(stderr, "{}\n", config::to_string(diagnostic));
}

void budget_of_daemon(Invocation& invocation) {
  auto& client = invocation.client();
  const auto response =
      client.call(&v1::BusService::Stub::GetBudget, v1::GetBudgetRequest(), std::string_view());
  if (invocation.json) return print_line(json(response));
  print_tables(response,
               client.call(&v1::GroupService::Stub::ListGroups, v1::ListGroupsRequest(), std::string_view()));
}

}  // namespace

void add_budget_command(CLI::App& app, Invocation& invocation) {
  auto* command = app.add_subcommand(
      "budget",
      "What each bus can promise: of FILE without a daemon (status 2 where it is refused), else of the "
      "daemon, beside the longest times that were seen");
  const auto path = std::make_shared<std::string>();
  command->add_option("FILE", *path, "The YAML file");
  command->callback([&invocation, path] {
    if (!path->empty()) return budget_of_file(invocation, *path);
    budget_of_daemon(invocation);
  });
}

}  // namespace axisd::axisctl
