#pragma once

#include <string>

namespace axisd::cell {

struct Options {
  std::string config = "/etc/axisd/cell.yaml";
  bool check = false;
  std::string log_level = "info";
  std::string machine_id_file = "/etc/machine-id";
};

/// The command line. Ends the process for --help, --version and errors (exit status 2, one line).
[[nodiscard]] Options parse_options(int argc, char** argv);

}  // namespace axisd::cell
