#pragma once

#include <string>

#include "config/configuration.hpp"
#include "daemon/options.hpp"

namespace axisd {

/// Reads the file that `--config` names; what the command line says comes before what the file says.
config::LoadResult load_configuration(const Options& options);

/// Runs the daemon until a signal ends it. `yaml`: what the configuration was read from. Exit status.
/// Precondition: called on the first thread, before any other was started.
int run_daemon(const Options& options, config::Configuration configuration, const std::string& yaml);

/// `axisd --quiesce`: stops every drive, prints a line per axis. Exit status 0: all standstills confirmed.
int run_quiesce(const Options& options);

}  // namespace axisd
