#pragma once

#include <optional>
#include <string>

namespace axisd {

struct Options {
  std::string config = "/etc/axisd/axisd.yaml";
  bool check = false;                                ///< load, report, exit
  bool schema = false;                               ///< print the JSON Schema, exit
  std::optional<std::string> restore_state;          ///< backup that is restored; then exit
  std::optional<std::string> quiesce;                ///< configuration whose axes are stopped; then exit
  std::string state_directory;                       ///< overrides the configuration's
  std::string listen;                                ///< likewise
  std::string wire_log;                              ///< file that gets every frame; empty: none
  std::string link_helper = "/run/axisd-link.sock";  ///< unix socket of axisd-link (M26)
  std::string log_level = "info";
};

/// The command line. Ends the process for --help, --version and errors (exit status 2, one line).
Options parse_options(int argc, char** argv);

}  // namespace axisd
