#include "daemon/options.hpp"

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <string>

#include "buses/port_number.hpp"

namespace axisd {

namespace {

/// As `listen` of the configuration. Empty: in order.
std::string judge_listen(const std::string& text) {
  const auto colon = text.rfind(':');
  const bool unix_socket = text.starts_with("unix:/");
  const bool host = colon != std::string::npos && colon > 0 && text.substr(0, colon) != "unix";
  if (unix_socket || (host && port_number(text.substr(colon + 1)))) return {};
  return "'" + text +
         "' is no address: write HOST:PORT, [IPV6]:PORT or unix:/PATH, with a port of 0 to 65535";
}

/// As `state_directory` of the configuration: the service does not start in the folder of whoever tries it.
std::string judge_directory(const std::string& text) {
  if (std::filesystem::path(text).is_absolute()) return {};
  return "'" + text + "' is no absolute path: write /PATH";
}

}  // namespace

Options parse_options(int argc, char** argv) {
  Options options;
  CLI::App app("axisd: owns a machine's drive buses and serves their axes over gRPC.", "axisd");
  app.footer(
      "Exit status: 0 ended in order; 1 could not start (an address or a state directory in use, no "
      "permission) or "
      "failed while running: trying again may help; 2 bad command line or configuration, certificates "
      "included. "
      "--quiesce: 0 every standstill is confirmed; 1 not every one; 2 no usable configuration, nothing was "
      "stopped.");
  app.set_version_flag("--version", std::string("axisd ") + AXISD_VERSION);
  app.add_option("--config", options.config, "configuration file")->capture_default_str();
  app.add_flag("--check", options.check, "check the configuration, print every error and warning, and exit");
  app.add_flag("--schema", options.schema, "print the JSON Schema of the configuration, and exit");
  app.add_option("--quiesce", options.quiesce, "stop every drive of this configuration, report, and exit");
  app.add_option(
      "--restore-state", options.restore_state,
      "put a backup (axisctl state backup) in the place of what the state directory holds, while no "
      "axisd uses it, and exit");
  app.add_option("--state-directory", options.state_directory,
                 "overrides state_directory of the configuration")
      ->check(judge_directory);
  app.add_option("--listen", options.listen, "overrides server: { listen } of the configuration")
      ->check(judge_listen);
  app.add_option("--wire-log", options.wire_log, "append every frame with its time to this file");
  app.add_option("--link-helper", options.link_helper,
                 "unix socket of axisd-link, which takes CAN links down and up")
      ->capture_default_str();
  app.add_option("--log-level", options.log_level, "trace, debug, info, warn, error")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error"}))
      ->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) std::exit(app.exit(error));
    std::cerr << "axisd: " << error.what() << "; see axisd --help\n";
    std::exit(2);
  }
  return options;
}

}  // namespace axisd
