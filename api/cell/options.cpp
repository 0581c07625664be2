#include "api/cell/options.hpp"

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <iostream>

namespace axisd::cell {

Options parse_options(int argc, char** argv) {
  Options options;
  CLI::App app("axisd-cell: the entrance of a cell, beside a machine's axisd.", "axisd-cell");
  app.footer(
      "Exit status: 0 ended in order; 1 could not start (an address in use) or failed while running: trying "
      "again may "
      "help; 2 bad command line, configuration or certificates.");
  app.set_version_flag("--version", std::string("axisd-cell ") + AXISD_VERSION);
  app.add_option("--config", options.config, "configuration file")->capture_default_str();
  app.add_flag("--check", options.check, "check configuration and certificates, print every error, and exit");
  app.add_option("--log-level", options.log_level, "trace, debug, info, warn, error")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error"}))
      ->capture_default_str();
  app.add_option("--machine-id-file", options.machine_id_file,
                 "what tells this computer from others; for several machines on one computer")
      ->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) std::exit(app.exit(error));
    std::cerr << "axisd-cell: " << error.what() << "; see axisd-cell --help\n";
    std::exit(2);
  }
  return options;
}

}  // namespace axisd::cell
