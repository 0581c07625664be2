// config show|check: what the daemon serves, and what it would say of another file.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>

#include "api/axisctl/format.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/terminal.hpp"
#include "axisd/v1/system_service.grpc.pb.h"

namespace axisd::axisctl {
namespace {

using Stub = v1::SystemService::Stub;

v1::GetConfigResponse served(Invocation& invocation) {
  return invocation.client().call(&Stub::GetConfig, v1::GetConfigRequest(), std::string_view());
}

void show(Invocation& invocation) {
  const auto response = served(invocation);
  print(invocation.json ? json(response) + "\n" : response.yaml());
}

std::string read(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file)
    throw Failure(ExitCode::usage, fmt::format("cannot read '{}': check path and permissions", path));
  return text;
}

void check(Invocation& invocation, const std::string& path) {
  v1::CheckConfigRequest request;
  request.set_yaml(read(path));
  const auto response = invocation.client().call(&Stub::CheckConfig, request, std::string_view());
  if (!response.findings().empty()) invocation.status = ExitCode::usage;
  if (invocation.json) return print_line(json(response));
  for (const auto& found : response.findings())
    fmt::print(stderr, "{}:{}:{}: {}{}{}\n", path, found.line(), found.column(), found.message(),
               found.suggestion().empty() ? "" : "; ", found.suggestion());
  if (!response.findings().empty()) return;
  const bool same = response.revision() == served(invocation).revision();
  print_line(fmt::format("{}: ok, {}", path, same ? "and it is what is served" : "not served yet"));
}

}  // namespace

void add_config_commands(CLI::App& app, Invocation& invocation) {
  auto* group = app.add_subcommand("config", "The daemon's configuration: show what is served, check a file");
  group->require_subcommand(1);
  group->footer(
      "\nExamples:\n"
      "  axisctl config show > press-1.yaml\n"
      "  axisctl config check press-1.yaml      by the daemon's version; without a daemon: axisctl check");
  group->add_subcommand("show", "The file that the daemon was started with, as it was then")
      ->callback([&invocation] { show(invocation); });
  auto* check_command =
      group->add_subcommand("check", "What the daemon would say of a file; status 2 on errors");
  const auto path = std::make_shared<std::string>();
  check_command->add_option("FILE", *path, "The YAML file")->required();
  check_command->callback([&invocation, path] { check(invocation, *path); });
}

}  // namespace axisd::axisctl
