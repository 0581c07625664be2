#pragma once

#include <string>
#include <vector>

namespace axisd::sim {

struct Options {
  std::string log, control;
  std::vector<std::string> drives;  ///< each as parse_drive() takes it
  bool list_switches = false;
  // On a pseudo terminal.
  std::string link, format = "8N1";
  int baud = 115200;
  int turnaround_us = 2000;
  // On a CAN interface; empty: on a pseudo terminal.
  std::string can;
  unsigned bitrate = 0;  ///< bit/s; 0: whatever the interface has
};

/// The command line. Ends the process for --help and errors (exit status 2, one line).
Options parse_options(int argc, char** argv);

}  // namespace axisd::sim
