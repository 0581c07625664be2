// The whole machine as one YAML file describes it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "buses/canopen/settings.hpp"
#include "buses/error.hpp"
#include "buses/modbus_rtu/settings.hpp"
#include "devices/access.hpp"
#include "devices/axis/settings.hpp"
#include "devices/generic/settings.hpp"
#include "devices/group/group.hpp"
#include "devices/lease/lease.hpp"

namespace axisd::canopen {
struct Eds;
}

namespace axisd::config {

struct TlsSettings {
  std::string certificate, key, client_ca;  ///< PEM files
  std::string crl;                          ///< likewise; empty: there is none
};

/// `limits:` of the server.
struct ServerLimits {
  int calls = 256;            ///< waiting, per client; stops are not counted
  int streams = 64;           ///< open, per client
  int connections = 256;      ///< of all clients
  int request_ids = 1 << 20;  ///< remembered, of all clients; see devices/axis/id_limits.hpp
  Duration stalled_reader = std::chrono::seconds(2);
};

/// `metrics:` of the server: figures for Prometheus, over HTTP, plain and for everybody who can connect.
struct MetricsSettings {
  std::string listen;   ///< HOST:PORT; empty: there are none
  bool remote = false;  ///< other machines may connect
};

/// Who may connect without TLS.
enum class Plaintext : std::uint8_t {
  loopback,      ///< every program of this computer
  unix_sockets,  ///< whom the permissions of a unix socket let in, and who is known as a user
};

struct ServerSettings {
  std::string listen =
      "localhost:7443";     ///< HOST:PORT or unix:PATH; without TLS only loopback and unix sockets
  std::string stop_listen;  ///< of the stop lane, as listen; empty: next to it
  std::optional<TlsSettings> tls;
  Plaintext plaintext = Plaintext::loopback;
  bool reflection = false;  ///< gRPC's, for tools that read the contract from the server
  MetricsSettings metrics;
  ServerLimits limits;
};

/// `simulate:` of an axis on a simulated bus: the mechanics around its drive. User units, axis direction, on
/// the load's own scale: `start_position` is where the load stands on it at power-up (when the drive's
/// counter is 0).
struct SimulationSettings {
  std::optional<double> home_switch;  ///< position of the home switch (active for `home_width` units)
  double home_width = 1;
  std::optional<double> positive_limit, negative_limit;
  double start_position = 0;        ///< where the load stands at power-up
  bool enabled_at_power_up = true;  ///< of the models that may power up with their stage on
  /// As simulation::set_unit_option() takes them. Empty: as `drive:` says.
  std::string velocity_unit, acceleration_unit;
  /// Of a drive that its data sheet makes, on a simulated bus: read when the file is loaded.
  std::shared_ptr<const canopen::Eds> sheet{};
};

struct AxisEntry {
  AxisSettings axis;
  SimulationSettings simulation;
};

/// `flight_recorder:` the newest frames of each bus, kept in memory and written to a file after a fault.
struct FlightRecorderSettings {
  int memory = 384;  ///< KiB per bus; some 10 exchanges on RS-485 take one
  int files = 20;    ///< kept in the state directory; the oldest go
};

/// `audit:` who asked for what, kept in the state directory.
struct AuditSettings {
  int files = 16;        ///< at most; the oldest go
  int file_size = 8192;  ///< KiB, about
};

struct Configuration {
  std::string machine;
  std::string state_directory = "/var/lib/axisd";  ///< where the daemon keeps its persistent state
  ServerSettings server;
  std::optional<AccessSettings> access;  ///< nothing: everybody may do everything
  FlightRecorderSettings flight_recorder;
  AuditSettings audit;
  LeaseSettings leases;                            ///< `control:` and `leases:`
  std::vector<modbus_rtu::LineSettings> lines;     ///< `buses:` of the kind modbus_rtu
  std::vector<canopen::NetworkSettings> networks;  ///< of the kind canopen
  std::vector<AxisEntry> axes;
  std::vector<DeviceSettings> devices;  ///< nodes that are not axes
  std::vector<GroupSettings> groups;    ///< axes that are moved together
};

/// One finding in a configuration file.
struct Diagnostic {
  std::string file;
  int line = 0, column = 0;  ///< 1-based
  std::string message;       ///< with the offending text
  std::string suggestion;    ///< empty if there is none
};
std::string to_string(
    const Diagnostic& diagnostic);  ///< "demo.yaml:12:5: unknown key 'velocty'; did you mean ..."

struct LoadResult {
  std::optional<Configuration> configuration;  ///< set if there is no diagnostic
  std::vector<Diagnostic> diagnostics;         ///< all errors at once, in the order of the file
  std::string text{};                          ///< of load_file(): what was read
  /// What was read where nothing but `budget: refuse` is against it: not to be served, but has figures.
  std::optional<Configuration> over_budget{};
};

/// Looks at the files that `server.tls` names: under which of its keys stands what is wrong. Handed in,
/// because it needs a library that is confined elsewhere, and because only who serves cares: a stop must not
/// fail for a certificate.
using TlsCheck = std::function<std::vector<std::pair<std::string_view, Error>>(const TlsSettings&)>;

/// Reads and checks a file completely. Never throws.
/// `original`: the file is a copy of that one, whose folder relative paths count from.
/// `check_tls`: empty: the files that it names are not looked at.
LoadResult load_file(const std::string& path, const std::string& original = {},
                     const TlsCheck& check_tls = {});
LoadResult load_text(std::string_view text, const std::string& file_name, const TlsCheck& check_tls = {},
                     Duration longest = Duration::max());

/// JSON Schema (draft 2020-12) of the file, generated from the definitions that the loader uses.
std::string json_schema();
/// axisd.yaml(5), in the language of man(7), generated from the same.
std::string manual_page();

}  // namespace axisd::config
