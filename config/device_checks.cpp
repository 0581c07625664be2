// Nodes that are not axes: their registers. How nodes share a bus is in machine_checks.cpp.
#include <fmt/format.h>

#include <map>
#include <string>

#include "config/checks.hpp"
#include "config/quantity.hpp"

namespace axisd::config {

namespace {

void check_registers(const DeviceSettings& device, Diagnostics& diagnostics, const Places& places) {
  std::map<int, std::string> owners;  // by address
  for (const auto& entry : device.values) {
    const auto path = fmt::format("devices.{}.registers.{}", device.name, entry.name);
    if (!places.usable(path + ".address") || !places.usable(path + ".type")) continue;
    const auto mark = places.mark(path + ".address");
    const int first = static_cast<int>(entry.address), count = register_count(entry.type);
    if (first + count > 0x10000) {
      diagnostics.add(mark, fmt::format("a 32-bit value at 0x{:04X} goes beyond the last register", first),
                      "the highest address is 0xFFFF");
    }
    for (int address = first; address < first + count; ++address) {
      const auto [owner, is_first] = owners.try_emplace(address, entry.name);
      if (is_first) continue;
      diagnostics.add(mark, fmt::format("register 0x{:04X} belongs to '{}' already", address, owner->second),
                      "32-bit values take two registers; each may have one name");
      break;
    }
  }
}

void check_objects(const DeviceSettings& device, Diagnostics& diagnostics, const Places& places) {
  std::map<std::uint32_t, std::string> owners;  // by address
  for (const auto& entry : device.values) {
    const auto path = fmt::format("devices.{}.objects.{}.object", device.name, entry.name);
    if (!places.usable(path)) continue;
    const auto [owner, is_first] = owners.try_emplace(entry.address, entry.name);
    if (is_first) continue;
    diagnostics.add(
        places.mark(path),
        fmt::format("object {} belongs to '{}' already", format_object_address(entry.address), owner->second),
        "each object may have one name");
  }
}

/// Its values stand under the key of its own kind, and only there.
bool check_values(const DeviceSettings& device, Diagnostics& diagnostics, const Places& places) {
  const auto path = fmt::format("devices.{}.", device.name);
  if (!places.usable(path + "model")) return false;
  const bool on_can = device.kind == BusKind::canopen;
  const std::string_view model = on_can ? "canopen-generic" : "modbus-generic";
  const std::string_view wanted = on_can ? "objects" : "registers", other = on_can ? "registers" : "objects";
  if (places.given(path + std::string(other))) {
    diagnostics.add(places.mark(path + std::string(other)), fmt::format("model {} has no {}", model, other),
                    fmt::format("it has {}", wanted));
  } else if (!places.given(path + std::string(wanted)) &&
             places.clean(fmt::format("devices.{}", device.name))) {
    diagnostics.add(places.mark(fmt::format("devices.{}", device.name)),
                    fmt::format("missing key '{}' in devices.{}", wanted, device.name));
  } else {
    return true;
  }
  return false;
}

void check_node(const DeviceSettings& device, Diagnostics& diagnostics, const Places& places) {
  constexpr int highest_node = 127;  // CiA 301
  const auto path = fmt::format("devices.{}.", device.name);
  if (device.kind != BusKind::canopen || device.node <= highest_node || !places.usable(path + "node") ||
      !places.usable(path + "model"))
    return;
  diagnostics.add(places.mark(path + "node"), fmt::format("{} is no node-ID of a CAN network", device.node),
                  fmt::format("write a value between 1 and {}", highest_node));
}

void check_turnaround(const DeviceSettings& device, Diagnostics& diagnostics, const Places& places) {
  const auto path = fmt::format("devices.{}.", device.name);
  if (device.kind == BusKind::modbus_rtu || !places.usable(path + "model") ||
      !places.given(path + "turnaround_max"))
    return;
  diagnostics.add(places.mark(path + "turnaround_max"), "model canopen-generic is not on RS-485",
                  "leave it out; the canopen bus has sdo_timeout");
}

}  // namespace

void check_devices(const Configuration& configuration, Diagnostics& diagnostics, const Places& places) {
  for (const auto& device : configuration.devices) {
    check_node(device, diagnostics, places);
    check_turnaround(device, diagnostics, places);
    if (!check_values(device, diagnostics, places)) continue;
    if (device.kind == BusKind::canopen) {
      check_objects(device, diagnostics, places);
    } else {
      check_registers(device, diagnostics, places);
    }
  }
}

}  // namespace axisd::config
