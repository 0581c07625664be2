#pragma once

#include <filesystem>
#include <string>

#include "api/tls/pem_files.hpp"
#include "config/configuration.hpp"
#include "daemon/options.hpp"

namespace axisd {

/// How axisd ends; deploy/axisd.service relies on them.
namespace exit_status {
inline constexpr int in_order = 0;
/// Something was in the way (a port in use, no permission, a certificate that is out of its time by the
/// clock), or an axis has not confirmed its standstill: trying again may help.
inline constexpr int failed = 1;
inline constexpr int configuration =
    2;  ///< or command line, files of certificates, limits of the process: trying again is pointless
}  // namespace exit_status

/// Copy of the last configuration that was served, for --quiesce when the file itself was broken meanwhile.
std::filesystem::path last_good(const std::string& state_directory);

/// Reads the file that `--config` names; what the command line says comes before what the file says.
/// `demand`: of the files of the certificates, as the service's user sees them. For a start it is
/// usable_some_time: a computer without a battery for its clock begins in the past. run_daemon() ends with
/// `failed` where they are not usable yet, or no more, to be tried again.
config::LoadResult load_configuration(const Options& options, tls::Demand demand);

/// Runs the daemon until a signal ends it. `yaml`: what the configuration was read from. Exit status.
/// Precondition: called on the first thread, before any other was started.
int run_daemon(const Options& options, const config::Configuration& configuration, const std::string& yaml);

/// `axisd --quiesce`: stops every drive, prints a line per axis. Exit status 0: all standstills confirmed.
int run_quiesce(const Options& options);

}  // namespace axisd
