// What /etc/axisd/cell.yaml says.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "api/tls/pem_files.hpp"
#include "api/transport/channel.hpp"
#include "buses/clock.hpp"
#include "config/diagnostics.hpp"

namespace axisd::cell {

/// `axisd:` the daemon beside this process.
struct DaemonSettings {
  std::string server = "localhost:7443";  ///< how this process reaches it
  std::string stop_server;                ///< its stop lane
  std::string advertise;                  ///< how other entrances reach it; empty: not at all
  std::string stop_advertise;             ///< likewise its stop lane
  transport::ClientFiles tls{};           ///< of this process, at all machines
};

/// `etcd:`
struct EtcdSettings {
  std::vector<std::string> endpoints;  ///< HOST:PORT; empty: without etcd
  transport::ClientFiles tls{};
  Duration ttl = std::chrono::seconds(15);  ///< of the lease; whole seconds
};

/// One of `peers:`, by hand. Empty: not known.
struct PeerSettings {
  std::string axisd, stop, cell;
};

enum class CellRole : std::uint8_t { viewer, operator_, maintainer };
[[nodiscard]] std::string_view to_string(CellRole role);

struct Settings {
  std::string cell, machine;
  std::string listen = "localhost:7445";
  std::string advertise;  ///< what other machines call; empty: nothing does
  std::optional<tls::Files> tls;
  DaemonSettings axisd;
  EtcdSettings etcd;
  std::map<std::string, PeerSettings, std::less<>> peers;
  /// By the names of certificates. Whoever is not among them is a viewer.
  std::map<std::string, CellRole, std::less<>> roles;
  std::string state = "/var/lib/axisd-cell";
  std::string metrics;  ///< HOST:PORT; empty: none
  int calls = 4096, calls_each = 256;
};

struct LoadedSettings {
  std::optional<Settings> settings;             ///< set if there is no diagnostic
  std::vector<config::Diagnostic> diagnostics;  ///< all errors at once, in the order of the file
};

/// Reads and checks a file completely. Blocks for the disk.
[[nodiscard]] LoadedSettings load_settings(const std::string& path);
[[nodiscard]] LoadedSettings read_settings(std::string_view text, const std::string& file_name);

/// Keys of the file, as "axisd.server": for the test that each has an effect.
[[nodiscard]] std::vector<std::string_view> setting_keys();

/// The role of somebody, by the name of their certificate.
[[nodiscard]] CellRole role_of(const Settings& settings, std::string_view name);

}  // namespace axisd::cell
