// config show|check|reload: what the daemon serves, what it would say of another file, and serving that.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>

#include "api/axisctl/event_text.hpp"
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

/// The note goes where it is not taken for a part of the file.
void show(Invocation& invocation) {
  const auto response = served(invocation);
  print(invocation.json ? json(response) + "\n" : response.yaml());
  if (response.file_revision() != response.revision())
    fmt::print(stderr, "note: {} {}\n", response.path(),
               response.file_revision().empty()
                   ? "cannot be read any more"
                   : "holds something else by now, which is served after: axisctl config reload");
}

std::string read(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  if (!file)
    throw Failure(ExitCode::usage, fmt::format("cannot read '{}': check path and permissions", path));
  return text;
}

/// What keeps the file `path` from being served, and what is to be known of it when it is.
template <class Response>
void print_judgement(const Response& response, const std::string& path) {
  for (const auto& found : response.findings())
    fmt::print(stderr, "{}:{}:{}: {}{}{}\n", path, found.line(), found.column(), found.message(),
               found.suggestion().empty() ? "" : "; ", found.suggestion());
  for (const auto& warning : response.warnings()) fmt::print(stderr, "{}: warning: {}\n", path, warning);
}

void check(Invocation& invocation, const std::string& path) {
  v1::CheckConfigRequest request;
  request.set_yaml(read(path));
  const auto response = invocation.client().call(&Stub::CheckConfig, request, std::string_view());
  if (!response.findings().empty()) invocation.status = ExitCode::usage;
  if (invocation.json) return print_line(json(response));
  print_judgement(response, path);
  if (!response.findings().empty()) return;
  const bool same = response.revision() == served(invocation).revision();
  print_line(fmt::format("{}: ok, {}", path, same ? "and it is what is served" : "not served yet"));
}

std::string refusal_text(const v1::ErrorDetail& refusal) {
  return refusal.remedy().empty() ? refusal.message()
                                  : fmt::format("{}; {}", refusal.message(), refusal.remedy());
}

void reload(Invocation& invocation, bool dry_run) {
  v1::ReloadConfigRequest request;
  request.set_dry_run(dry_run);
  const auto response = invocation.client().call(&Stub::ReloadConfig, request, std::string_view());
  if (!response.refusals().empty()) invocation.status = ExitCode::refused;
  if (!response.findings().empty()) invocation.status = ExitCode::usage;
  if (invocation.json) return print_line(json(response));
  if (!response.findings().empty() || !response.warnings().empty())
    print_judgement(response, served(invocation).path());
  for (const auto& refusal : response.refusals()) fmt::print(stderr, "refused: {}\n", refusal_text(refusal));
  if (!response.findings().empty()) return print_line("not reloaded: nothing was changed");
  for (const auto& change : response.changes()) print_line(text_of(change));
  if (!response.refusals().empty()) return print_line("not reloaded: nothing was changed");
  if (response.changes().empty())
    print_line(response.previous_revision() == response.revision() ? "nothing has changed"
                                                                   : "only how it is written has changed");
  print_line(response.applied() ? "reloaded" : "could be reloaded now");
}

}  // namespace

void add_config_commands(CLI::App& app, Invocation& invocation) {
  auto* group = app.add_subcommand("config", "The daemon's configuration: show, check, reload");
  group->require_subcommand(1);
  group->footer(
      "\nExamples:\n"
      "  axisctl config show > press-1.yaml\n"
      "  axisctl config check press-1.yaml      by the daemon's version; without a daemon: axisctl check\n"
      "  axisctl config reload --dry-run        what the daemon's file would change, and what is in the way");
  group->add_subcommand("show", "What is served: the daemon's file as it was at its start or the last reload")
      ->callback([&invocation] { show(invocation); });
  auto* check_command =
      group->add_subcommand("check", "What the daemon would say of a file; status 2 on errors");
  const auto path = std::make_shared<std::string>();
  check_command->add_option("FILE", *path, "The YAML file")->required();
  check_command->callback([&invocation, path] { check(invocation, *path); });
  auto* reload_command = group->add_subcommand(
      "reload",
      "Serve what the daemon's file says now: all or nothing, only what changed, nothing that moves");
  const auto dry_run = std::make_shared<bool>(false);
  reload_command->add_flag("--dry-run", *dry_run, "Only tell what would change, and what stands against it");
  reload_command->callback([&invocation, dry_run] { reload(invocation, *dry_run); });
}

}  // namespace axisd::axisctl
