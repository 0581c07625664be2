// What /etc/axisd/web.yaml says.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "buses/clock.hpp"
#include "config/diagnostics.hpp"

namespace axisd::web {

/// `tls:` PEM files.
struct TlsSettings {
  std::string certificate, key;
  std::string client_ca;  ///< whose certificates stand for persons; empty: nobody's
};

/// `axisd:` the daemon.
struct DaemonSettings {
  std::string server = "localhost:7443";
  std::string stop_server;           ///< of its stop lane; empty: next to `server`
  std::string ca, certificate, key;  ///< PEM files; empty: without TLS
};

/// `limits:` of all, and of each address or person.
struct LimitSettings {
  int connections = 256, connections_each = 64;
  int streams = 256, streams_each = 64;  ///< calls that are open; of a person
  int lanes = 128, lanes_each = 16;
  int body = 256;                               ///< KiB of a request
  Duration log_in = std::chrono::seconds(30);   ///< of a connection on which nobody is known
  Duration request = std::chrono::seconds(10);  ///< from its first byte to its last, a handshake too
  Duration idle = std::chrono::seconds(75);     ///< between requests
  Duration stalled = std::chrono::seconds(30);  ///< of a page that takes nothing of what is sent to it
};

struct Settings {
  std::string listen = "localhost:7480";
  std::optional<TlsSettings> tls;
  DaemonSettings axisd;
  /// Several machines in place of one, by their names; each with the certificates of `axisd`.
  std::map<std::string, DaemonSettings, std::less<>> machines;
  std::string files = "/usr/share/axisd-web";  ///< the page
  std::string users = "/var/lib/axisd-web/users";
  bool users_named = false;  ///< the file says it
  Duration session_idle = std::chrono::minutes(60), session_longest = std::chrono::minutes(720);
  LimitSettings limits;
};

struct LoadedSettings {
  std::optional<Settings> settings;             ///< set if there is no diagnostic
  std::vector<config::Diagnostic> diagnostics;  ///< all errors at once, in the order of the file
};

/// Reads and checks a file completely. Blocks for the disk.
[[nodiscard]] LoadedSettings load_settings(const std::string& path);
[[nodiscard]] LoadedSettings read_settings(std::string_view text, const std::string& file_name);

/// [a-z][a-z0-9_-]*, at most 64 letters.
[[nodiscard]] bool is_machine_name(std::string_view name);

/// Keys of the file, as "limits.body": for the test that each has an effect.
[[nodiscard]] std::vector<std::string_view> setting_keys();

}  // namespace axisd::web
