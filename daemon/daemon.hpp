#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/configuration.hpp"
#include "daemon/options.hpp"

namespace axisd {

/// How axisd ends; deploy/axisd.service relies on them.
namespace exit_status {
inline constexpr int in_order = 0;
/// Something was in the way (a port in use, no permission), or an axis has not confirmed its standstill:
/// trying again may help.
inline constexpr int failed = 1;
inline constexpr int configuration =
    2;  ///< or command line, certificates, limits of the process: trying again is pointless
}  // namespace exit_status

/// Copy of the last configuration that was served, for --quiesce when the file itself was broken meanwhile.
std::filesystem::path last_good(const std::string& state_directory);

/// A config::TlsCheck: the files as the service's user sees them.
std::vector<std::pair<std::string_view, Error>> check_tls(const config::TlsSettings& tls);

/// What is right in the files of the certificates beside files that are good.
enum class TlsFilesMay : std::uint8_t {
  only_be_good,
  /// For a start: a computer without a battery for its clock begins in the past. run_daemon() ends with
  /// `failed` then, to be tried again.
  be_valid_later,
};

/// Reads the file that `--config` names; what the command line says comes before what the file says.
config::LoadResult load_configuration(const Options& options, TlsFilesMay may);

/// Runs the daemon until a signal ends it. `yaml`: what the configuration was read from. Exit status.
/// Precondition: called on the first thread, before any other was started.
int run_daemon(const Options& options, const config::Configuration& configuration, const std::string& yaml);

/// `axisd --quiesce`: stops every drive, prints a line per axis. Exit status 0: all standstills confirmed.
int run_quiesce(const Options& options);

}  // namespace axisd
