#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

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

void check_server(const Configuration& configuration, Diagnostics& diagnostics, const Places& places) {
  const std::string_view listen = configuration.server.listen;
  if (!places.usable("server.listen") || listen.starts_with("unix:")) return;
  const auto colon = listen.rfind(':');
  const auto host = listen.substr(0, colon), port = listen.substr(colon + 1);
  const auto mark = places.mark("server.listen");
  if (const auto number = parse_decimal(port); !number || number->value > 65535) {
    diagnostics.add(mark, fmt::format("port {} is out of range", quoted(port)),
                    "write a port between 0 and 65535");
  }
  if (!is_loopback(host) && !configuration.server.tls && !places.given("server.tls")) {
    diagnostics.add(
        mark,
        fmt::format("without tls, {} would let anybody on the network move this machine", quoted(listen)),
        "add server.tls, or listen on localhost or unix:/PATH");
  }
}

void check_ports(const Configuration& configuration, Diagnostics& diagnostics, const Places& places) {
  std::map<std::string, std::string> owners;
  for (const auto& bus : configuration.lines) {
    const auto path = fmt::format("buses.{}.modbus_rtu.port", bus.name);
    if (!places.usable(path) || bus.simulated()) continue;
    const auto [owner, is_first] = owners.try_emplace(bus.port, bus.name);
    if (!is_first) {
      diagnostics.add(places.mark(path),
                      fmt::format("port {} belongs to bus '{}' already", quoted(bus.port), owner->second),
                      "one bus per port");
    }
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

void check_bus_names(const Configuration& configuration, Diagnostics& diagnostics, const Places& places) {
  if (!places.clean("buses")) return;  // a bus may be missing because of its own errors
  const auto names =
      names_of(configuration.lines, [](const auto& bus) -> std::string_view { return bus.name; });
  for (const auto& [participant, text, bus, node] : participants(configuration)) {
    const auto path = participant + "bus";
    if (!places.usable(path) || std::ranges::find(names, bus) != names.end()) continue;
    diagnostics.add(places.mark(path), fmt::format("there is no bus {}", quoted(bus)), suggest(bus, names));
  }
}

void check_drive_counts(const Configuration& configuration, Diagnostics& diagnostics, const Places& places) {
  constexpr int most = 30;  // what one RS-485 line carries (RTU manuals 4.4)
  std::map<std::string_view, int> counts;
  for (const auto& [axis, simulation] : configuration.axes) {
    const auto path = fmt::format("axes.{}.bus", axis.name);
    if (!places.usable(path) || ++counts[axis.bus] != most + 1) continue;
    diagnostics.add(places.mark(path), fmt::format("bus '{}' has more than {} drives", axis.bus, most),
                    "put the rest on another line");
  }
}

void check_bauds(const Configuration& configuration, Diagnostics& diagnostics, const Places& places) {
  std::set<std::pair<std::string, std::string>> reported;  // bus and model
  for (const auto& [axis, simulation] : configuration.axes) {
    const auto* model = find_drive_model(axis.model);
    const auto bus = std::ranges::find(configuration.lines, axis.bus, &modbus_rtu::LineSettings::name);
    if (model == nullptr || bus == configuration.lines.end()) continue;
    const auto path = fmt::format("buses.{}.modbus_rtu.baud", bus->name);
    if (!places.usable(path) || std::ranges::find(model->bauds, bus->baud) != model->bauds.end()) continue;
    if (!reported.emplace(bus->name, axis.model).second) continue;
    std::vector<std::string> texts;
    for (const auto baud : model->bauds) texts.push_back(std::to_string(baud));
    const auto permitted = names_of(texts, [](const std::string& text) -> std::string_view { return text; });
    diagnostics.add(
        places.mark(path),
        fmt::format("model {} of axis '{}' cannot be set to {} baud", axis.model, axis.name, bus->baud),
        "permitted: " + alternatives(permitted));
  }
}

void check_simulation(const Configuration& configuration, Diagnostics& diagnostics, const Places& places) {
  for (const auto& [axis, simulation] : configuration.axes) {
    const auto path = fmt::format("axes.{}.simulate", axis.name);
    const auto bus = std::ranges::find(configuration.lines, axis.bus, &modbus_rtu::LineSettings::name);
    if (!places.given(path) || bus == configuration.lines.end() || bus->simulated()) continue;
    if (!places.usable(fmt::format("buses.{}.modbus_rtu.port", bus->name))) continue;
    diagnostics.add(places.mark(path),
                    fmt::format("'simulate' has no effect: bus '{}' is not simulated", bus->name),
                    "leave it out, or set port: sim");
  }
}

}  // namespace

void check_machine(const Configuration& configuration, Diagnostics& diagnostics, const Places& places) {
  check_server(configuration, diagnostics, places);
  check_ports(configuration, diagnostics, places);
  check_bus_names(configuration, diagnostics, places);
  check_nodes(configuration, diagnostics, places);
  check_drive_counts(configuration, diagnostics, places);
  check_bauds(configuration, diagnostics, places);
  check_simulation(configuration, diagnostics, places);
}

}  // namespace axisd::config
