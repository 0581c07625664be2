// check, schema, completion, man: nothing here talks to a daemon.
#include <fmt/format.h>
#include <google/protobuf/struct.pb.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "api/axisctl/completion.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/invocation.hpp"
#include "api/axisctl/man_page.hpp"
#include "api/axisctl/terminal.hpp"
#include "api/tls/pem_files.hpp"
#include "config/budget.hpp"
#include "config/configuration.hpp"

namespace axisd::axisctl {
namespace {

google::protobuf::Struct as_message(const config::LoadResult& result,
                                    const std::vector<std::string>& warnings) {
  google::protobuf::Struct message;
  (*message.mutable_fields())["valid"].set_bool_value(result.configuration.has_value());
  auto& list = *(*message.mutable_fields())["diagnostics"].mutable_list_value();
  for (const auto& diagnostic : result.diagnostics) {
    auto& fields = *list.add_values()->mutable_struct_value()->mutable_fields();
    fields["file"].set_string_value(diagnostic.file);
    fields["line"].set_number_value(diagnostic.line);
    fields["column"].set_number_value(diagnostic.column);
    fields["message"].set_string_value(diagnostic.message);
    fields["suggestion"].set_string_value(diagnostic.suggestion);
  }
  auto& warned = *(*message.mutable_fields())["warnings"].mutable_list_value();
  for (const auto& warning : warnings) warned.add_values()->set_string_value(warning);
  return message;
}

tls::Findings check_tls(const config::TlsSettings& tls) {
  return tls::check(
      {.certificate = tls.certificate, .key = tls.key, .client_ca = tls.client_ca, .crl = tls.crl});
}

/// `elsewhere`: the file is for another computer, where its certificates are.
void check(Invocation& invocation, const std::string& path, bool elsewhere) {
  const auto result = config::load_file(path, {}, elsewhere ? config::TlsCheck() : check_tls);
  if (!result.configuration) invocation.status = ExitCode::usage;
  const auto warnings =
      result.configuration ? config::warnings(*result.configuration) : std::vector<std::string>();
  if (invocation.json) return print_line(json(as_message(result, warnings)));
  for (const auto& diagnostic : result.diagnostics) fmt::print(stderr, "{}\n", config::to_string(diagnostic));
  for (const auto& warning : warnings) fmt::print(stderr, "{}: warning: {}\n", path, warning);
  if (result.configuration)
    print_line(fmt::format("{}: ok, machine '{}', axes: {}, buses: {}", path, result.configuration->machine,
                           result.configuration->axes.size(),
                           result.configuration->lines.size() + result.configuration->networks.size()));
  else
    fmt::print(stderr, "axisctl: {}: {} error{}\n", path, result.diagnostics.size(),
               result.diagnostics.size() == 1 ? "" : "s");
}

}  // namespace

void add_offline_commands(CLI::App& app, Invocation& invocation) {
  auto* check_command =
      app.add_subcommand("check", "Check a configuration file without a daemon; status 2 on errors");
  const auto path = std::make_shared<std::string>();
  check_command->add_option("FILE", *path, "The YAML file")->required();
  const auto elsewhere = std::make_shared<bool>(false);
  check_command->add_flag("--elsewhere", *elsewhere,
                          "The file is for another computer: do not look for its certificates here");
  check_command->callback([&invocation, path, elsewhere] { check(invocation, *path, *elsewhere); });

  app.add_subcommand("schema", "JSON Schema of the configuration file, for editors")->callback([] {
    print_line(config::json_schema());
  });

  auto* completion = app.add_subcommand("completion",
                                        "Completion script: eval \"$(axisctl completion bash)\"; zsh alike; "
                                        "fish: axisctl completion fish | source");
  const auto shell = std::make_shared<std::string>();
  completion->add_option("SHELL", *shell, "bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember(completion_shells()));
  completion->callback([shell] { print(completion_script(*shell)); });

  auto* man = app.add_subcommand("man", "A manual page: axisctl man | man -l -");
  const auto page = std::make_shared<std::string>("axisctl");
  man->add_option("PAGE", *page, "axisctl, or axisd.yaml, the configuration file")
      ->check(CLI::IsMember({"axisctl", "axisd.yaml"}))
      ->capture_default_str();
  man->callback([&app, page] { print(*page == "axisctl" ? man_page(app) : config::manual_page()); });
}

}  // namespace axisd::axisctl
