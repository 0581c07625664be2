#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "buses/port_number.hpp"
#include "config/checks.hpp"
#include "config/quantity.hpp"
#include "config/text.hpp"
#include "devices/descriptor.hpp"

namespace axisd::config {

namespace {

bool is_loopback(std::string_view host) {
  // 127.0.0.0/8 in dotted form only: a name that merely begins so could resolve to anything.
  const bool dotted = host.starts_with("127.") &&
                      host.find_first_not_of("0123456789.") == std::string_view::npos &&
                      std::ranges::count(host, '.') == 3;
  return host == "localhost" || host == "[::1]" || dotted;
}

void check_port(std::string_view port, Mark mark, Diagnostics& diagnostics) {
  if (port_number(port)) return;
  diagnostics.add(mark, fmt::format("port {} is out of range", quoted(port)),
                  "write a port between 0 and 65535");
}

void check_address(std::string_view key, std::string_view listen, const Configuration& configuration,
                   Diagnostics& diagnostics, const Places& places) {
  if (!places.usable(key) || listen.empty() || listen.starts_with("unix:")) return;
  const auto colon = listen.rfind(':');
  const auto host = listen.substr(0, colon), port = listen.substr(colon + 1);
  const auto mark = places.mark(key);
  check_port(port, mark, diagnostics);
  if (configuration.server.tls || places.given("server.tls")) return;
  if (!is_loopback(host)) {
    diagnostics.add(
        mark,
        fmt::format("without tls, {} would let anybody on the network move this machine", quoted(listen)),
        "add server.tls, or listen on localhost or unix:/PATH");
  } else if (configuration.server.plaintext == Plaintext::unix_sockets) {
    diagnostics.add(
        mark,
        fmt::format("without tls, {} is for plaintext, which server.plaintext forbids there", quoted(listen)),
        "add server.tls, or listen on unix:/PATH");
  }
}

void check_metrics(const MetricsSettings& metrics, Diagnostics& diagnostics, const Places& places) {
  if (!places.usable("server.metrics.listen") || metrics.listen.empty()) return;
  const std::string_view listen = metrics.listen;
  const auto colon = listen.rfind(':');
  const auto port = listen.substr(colon + 1);
  check_port(port, places.mark("server.metrics.listen"), diagnostics);
  if (!is_loopback(listen.substr(0, colon)) && !metrics.remote && places.usable("server.metrics.remote"))
    diagnostics.add(places.mark("server.metrics.listen"),
                    fmt::format("everybody on the network could read the metrics at {}", quoted(listen)),
                    "listen on localhost, or say server.metrics.remote: true if that is meant");
}

/// Whoever listens at the one listens at the other, too.
bool includes(std::string_view host, std::string_view other) {
  if (host == "0.0.0.0") return !other.starts_with('[');
  if (host == "localhost" && (other == "127.0.0.1" || other == "[::1]")) return true;
  return host == "[::]" || host == other;
}

bool is_same_address(std::string_view one, std::string_view other) {
  const auto colon = one.rfind(':'), other_colon = other.rfind(':');
  if (colon == std::string_view::npos || other_colon == std::string_view::npos) return false;
  const auto port = port_number(one.substr(colon + 1));
  if (!port || *port == 0 || port != port_number(other.substr(other_colon + 1))) return false;
  const auto host = one.substr(0, colon), other_host = other.substr(0, other_colon);
  return includes(host, other_host) || includes(other_host, host);
}

/// Where stops are taken without stop_listen; empty: there is no such port.
std::string stop_lane_beside(std::string_view listen) {
  const auto colon = listen.rfind(':');
  if (listen.starts_with("unix:") || colon == std::string_view::npos) return {};
  const auto port = port_number(listen.substr(colon + 1));
  return port && *port != 0 ? fmt::format("{}:{}", listen.substr(0, colon), *port + 1) : std::string();
}

void check_metrics_apart(const ServerSettings& server, Diagnostics& diagnostics, const Places& places) {
  if (!places.usable("server.metrics.listen") || server.metrics.listen.empty()) return;
  const auto add = [&](std::string_view what) {
    diagnostics.add(places.mark("server.metrics.listen"),
                    fmt::format("{} is {}, too", quoted(server.metrics.listen), what),
                    "give the metrics a port of their own, such as that of server.listen + 2");
  };
  if (places.usable("server.listen") && is_same_address(server.metrics.listen, server.listen))
    return add("server.listen");
  const bool of_its_own = !server.stop_listen.empty();
  const auto stops = of_its_own ? server.stop_listen : stop_lane_beside(server.listen);
  if (places.usable(of_its_own ? "server.stop_listen" : "server.listen") &&
      is_same_address(server.metrics.listen, stops))
    add(of_its_own ? "server.stop_listen"
                   : "the address of the stops (the port after that of server.listen)");
}

void check_server(const Configuration& configuration, Diagnostics& diagnostics, const Places& places) {
  const auto& server = configuration.server;
  check_address("server.listen", server.listen, configuration, diagnostics, places);
  check_address("server.stop_listen", server.stop_listen, configuration, diagnostics, places);
  check_metrics(server.metrics, diagnostics, places);
  check_metrics_apart(server, diagnostics, places);
  if (!server.stop_listen.empty() && server.stop_listen == server.listen)
    diagnostics.add(places.mark("server.stop_listen"),
                    fmt::format("{} is server.listen, too", quoted(server.listen)),
                    "give the stop lane an address of its own, or leave the key out");
  if (server.stop_listen.empty() && server.listen.ends_with(":65535") && places.usable("server.listen"))
    diagnostics.add(places.mark("server.listen"), "there is no port after 65535 for the stop lane",
                    "choose another port, or say server.stop_listen");
}

/// A bus as the file describes it, of whatever kind.
struct BusEntry {
  std::string_view name;
  BusKind kind;
  bool simulated;
  std::int64_t rate;      ///< baud or bit/s
  std::string_view port;  ///< or network interface
  std::string_view port_key, rate_key;

  [[nodiscard]] std::string_view kind_name() const {
    return kind == BusKind::modbus_rtu ? "modbus_rtu" : "canopen";
  }
  [[nodiscard]] std::string path(std::string_view key) const {
    return fmt::format("buses.{}.{}.{}", name, kind_name(), key);
  }
};

std::vector<BusEntry> buses(const Configuration& configuration) {
  std::vector<BusEntry> all;
  all.reserve(configuration.lines.size() + configuration.networks.size());
  for (const auto& line : configuration.lines)
    all.push_back({line.name, BusKind::modbus_rtu, line.simulated(), line.baud, line.port, "port", "baud"});
  for (const auto& network : configuration.networks)
    all.push_back({network.name, BusKind::canopen, network.simulated(), network.bitrate, network.interface,
                   "interface", "bitrate"});
  return all;
}

const BusEntry* find_bus(std::span<const BusEntry> all, std::string_view name) {
  const auto found = std::ranges::find(all, name, &BusEntry::name);
  return found == all.end() ? nullptr : &*found;
}

void check_ports(std::span<const BusEntry> all, Diagnostics& diagnostics, const Places& places) {
  std::map<std::string_view, std::string_view> owners;  // a device file has a slash, a network interface none
  for (const auto& bus : all) {
    const auto path = bus.path(bus.port_key);
    if (!places.usable(path) || bus.simulated) continue;
    const auto [owner, is_first] = owners.try_emplace(bus.port, bus.name);
    if (is_first) continue;
    diagnostics.add(
        places.mark(path),
        fmt::format("{} {} belongs to bus '{}' already", bus.port_key, quoted(bus.port), owner->second),
        fmt::format("one bus per {}", bus.port_key));
  }
}

/// A participant of a bus as the file names it.
struct Participant {
  std::string path;  ///< "axes.feeder."
  std::string text;  ///< "axis 'feeder'"
  const std::string& bus;
  int node;
};

std::vector<Participant> participants(const Configuration& configuration) {
  std::vector<Participant> all;
  for (const auto& entry : configuration.axes) {
    const auto& axis = entry.axis;
    all.push_back(
        {fmt::format("axes.{}.", axis.name), fmt::format("axis '{}'", axis.name), axis.bus, axis.node});
  }
  for (const auto& device : configuration.devices)
    all.push_back({fmt::format("devices.{}.", device.name), fmt::format("device '{}'", device.name),
                   device.bus, device.node});
  return all;
}

void check_nodes(const Configuration& configuration, Diagnostics& diagnostics, const Places& places) {
  std::map<std::pair<std::string, int>, std::string> owners;
  for (const auto& [path, text, bus, node] : participants(configuration)) {
    if (!places.usable(path + "bus") || !places.usable(path + "node")) continue;
    const auto [owner, is_first] = owners.try_emplace({bus, node}, text);
    if (!is_first) {
      diagnostics.add(places.mark(path + "node"),
                      fmt::format("node {} on bus '{}' is {} already", node, bus, owner->second),
                      "give each node an address of its own");
    }
  }
}

void check_bus_names(const Configuration& configuration, std::span<const BusEntry> all,
                     Diagnostics& diagnostics, const Places& places) {
  if (!places.clean("buses")) return;  // a bus may be missing because of its own errors
  const auto names = names_of(all, [](const BusEntry& bus) { return bus.name; });
  for (const auto& [participant, text, bus, node] : participants(configuration)) {
    const auto path = participant + "bus";
    if (!places.usable(path) || find_bus(all, bus) != nullptr) continue;
    diagnostics.add(places.mark(path), fmt::format("there is no bus {}", quoted(bus)), suggest(bus, names));
  }
}

/// A model speaks one protocol.
void check_kinds(const Configuration& configuration, std::span<const BusEntry> all, Diagnostics& diagnostics,
                 const Places& places) {
  const auto check = [&](const std::string& section, const std::string& bus_name, std::string_view model,
                         BusKind kind) {
    const auto* bus = find_bus(all, bus_name);
    const auto path = section + ".bus";
    if (bus == nullptr || bus->kind == kind || !places.usable(path) || !places.usable(section + ".model") ||
        !places.usable("buses." + bus_name))
      return;
    const bool on_can = bus->kind == BusKind::canopen;
    diagnostics.add(places.mark(path),
                    fmt::format("model {} cannot be on bus '{}', which is {}", model, bus_name,
                                on_can ? "a CAN network" : "an RS-485 line"),
                    on_can ? "name a bus of the kind modbus_rtu" : "name a bus of the kind canopen");
  };
  for (const auto& [axis, simulation] : configuration.axes)
    if (const auto* model = find_drive_model(axis.model))
      check("axes." + axis.name, axis.bus, axis.model, model->bus);
  for (const auto& device : configuration.devices)
    check("devices." + device.name, device.bus,
          device.kind == BusKind::canopen ? "canopen-generic" : "modbus-generic", device.kind);
}

void check_drive_counts(const Configuration& configuration, std::span<const BusEntry> all,
                        Diagnostics& diagnostics, const Places& places) {
  std::map<std::string_view, int> counts;
  for (const auto& [axis, simulation] : configuration.axes) {
    const auto path = fmt::format("axes.{}.bus", axis.name);
    const auto* bus = find_bus(all, axis.bus);
    if (bus == nullptr || !places.usable(path)) continue;
    const int most = bus->kind == BusKind::modbus_rtu ? 30 : 32;  // manuals of both kinds, 4.4
    if (++counts[axis.bus] != most + 1) continue;
    diagnostics.add(places.mark(path), fmt::format("bus '{}' has more than {} drives", axis.bus, most),
                    "put the rest on another bus");
  }
}

void check_rates(const Configuration& configuration, std::span<const BusEntry> all, Diagnostics& diagnostics,
                 const Places& places) {
  std::set<std::pair<std::string, std::string>> reported;  // bus and model
  for (const auto& [axis, simulation] : configuration.axes) {
    const auto* model = find_drive_model(axis.model);
    const auto* bus = find_bus(all, axis.bus);
    if (model == nullptr || bus == nullptr || model->bus != bus->kind) continue;
    const auto path = bus->path(bus->rate_key);
    if (!places.usable(path) || std::ranges::find(model->bauds, bus->rate) != model->bauds.end()) continue;
    if (!reported.emplace(bus->name, axis.model).second) continue;
    std::vector<std::string> texts;
    for (const auto rate : model->bauds) texts.push_back(std::to_string(rate));
    const auto permitted = names_of(texts, [](const std::string& text) -> std::string_view { return text; });
    diagnostics.add(places.mark(path),
                    fmt::format("model {} of axis '{}' cannot be set to {} {}", axis.model, axis.name,
                                bus->rate, bus->kind == BusKind::modbus_rtu ? "baud" : "bit/s"),
                    "permitted: " + alternatives(permitted));
  }
}

void check_simulation(const Configuration& configuration, std::span<const BusEntry> all,
                      Diagnostics& diagnostics, const Places& places) {
  for (const auto& [axis, simulation] : configuration.axes) {
    const auto path = fmt::format("axes.{}.simulate", axis.name);
    const auto* bus = find_bus(all, axis.bus);
    if (!places.given(path) || bus == nullptr) continue;
    const auto power_up = path + ".enabled_at_power_up";
    if (bus->kind == BusKind::canopen && places.given(power_up))
      diagnostics.add(
          places.mark(power_up),
          fmt::format("'enabled_at_power_up' has no effect: model {} powers up released (CiA 402)",
                      axis.model),
          "leave it out");
    if (bus->simulated) continue;
    if (!places.usable(bus->path(bus->port_key))) continue;
    diagnostics.add(places.mark(path),
                    fmt::format("'simulate' has no effect: bus '{}' is not simulated", bus->name),
                    fmt::format("leave it out, or set {}: sim", bus->port_key));
  }
}

void check_answers(const Configuration& configuration, std::span<const BusEntry> all,
                   Diagnostics& diagnostics, const Places& places) {
  for (const auto& network : configuration.networks) {
    const auto* bus = find_bus(all, network.name);
    if (bus == nullptr || network.sdo_answer <= network.sdo_timeout) continue;
    if (!places.usable(bus->path("sdo_answer")) || !places.usable(bus->path("sdo_timeout"))) continue;
    diagnostics.add(places.mark(bus->path("sdo_answer")),
                    fmt::format("answers that take {} as a rule are given up after {} (sdo_timeout)",
                                format_duration(network.sdo_answer), format_duration(network.sdo_timeout)),
                    "write a longer sdo_timeout, several times sdo_answer");
  }
}

void check_leases(const LeaseSettings& leases, Diagnostics& diagnostics, const Places& places) {
  if (!places.clean("leases")) return;
  if (leases.shortest_ttl <= leases.default_ttl && leases.default_ttl <= leases.longest_ttl) return;
  diagnostics.add(places.mark("leases.default_ttl"),
                  fmt::format("a default_ttl of {} lies outside shortest_ttl to longest_ttl, {} to {}",
                              format_duration(leases.default_ttl), format_duration(leases.shortest_ttl),
                              format_duration(leases.longest_ttl)),
                  "write a default_ttl between the other two");
}

void check_groups(const Configuration& configuration, Diagnostics& diagnostics, const Places& places) {
  std::vector<std::string_view> names;
  names.reserve(configuration.axes.size());
  for (const auto& entry : configuration.axes) names.emplace_back(entry.axis.name);
  for (const auto& group : configuration.groups) {
    // Where either may be named, a name has to say which.
    if (const auto section = fmt::format("groups.{}", group.name);
        std::ranges::find(names, group.name) != names.end() && places.usable(section))
      diagnostics.add(places.mark(section), fmt::format("group '{}' has the name of an axis", group.name),
                      "give one of the two another name");
    const auto path = fmt::format("groups.{}.axes", group.name);
    if (!places.usable(path)) continue;
    for (const auto& axis : group.axes)
      if (std::ranges::find(names, axis) == names.end())
        diagnostics.add(places.mark(path), fmt::format("group '{}': there is no axis '{}'", group.name, axis),
                        suggest(axis, names));
  }
}

void check_access(const Configuration& configuration, Diagnostics& diagnostics, const Places& places) {
  if (!configuration.access) return;
  std::vector<std::string_view> names;
  for (const auto& entry : configuration.axes) names.emplace_back(entry.axis.name);
  for (const auto& group : configuration.groups) names.emplace_back(group.name);
  for (const auto& [name, roles] : configuration.access->axes)
    if (std::ranges::find(names, name) == names.end())
      diagnostics.add(places.mark(fmt::format("access.axes.{}", name)),
                      fmt::format("there is no axis and no group {}", quoted(name)), suggest(name, names));
}

}  // namespace

void check_tls_files(const Configuration& configuration, const TlsCheck& check, Diagnostics& diagnostics,
                     const Places& places) {
  if (!configuration.server.tls || !places.clean("server.tls")) return;
  for (const auto& [key, error] : check(*configuration.server.tls))
    diagnostics.add(places.mark(fmt::format("server.tls.{}", key)), error.message, error.remedy);
}

void check_machine(const Configuration& configuration, Diagnostics& diagnostics, const Places& places) {
  const auto all = buses(configuration);
  check_server(configuration, diagnostics, places);
  check_leases(configuration.leases, diagnostics, places);
  check_groups(configuration, diagnostics, places);
  check_access(configuration, diagnostics, places);
  check_ports(all, diagnostics, places);
  check_bus_names(configuration, all, diagnostics, places);
  check_kinds(configuration, all, diagnostics, places);
  check_nodes(configuration, diagnostics, places);
  check_drive_counts(configuration, all, diagnostics, places);
  check_rates(configuration, all, diagnostics, places);
  check_simulation(configuration, all, diagnostics, places);
  check_answers(configuration, all, diagnostics, places);
}

}  // namespace axisd::config
