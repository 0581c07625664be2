// Nodes that are not axes: their registers. How nodes share a bus is in machine_checks.cpp.
#include <fmt/format.h>

#include <map>
#include <string>

#include "config/checks.hpp"

namespace axisd::config {

namespace {

void check_registers(const DeviceSettings& device, Diagnostics& diagnostics, const Places& places) {
  std::map<int, std::string> owners;  // by address
  for (const auto& entry : device.registers) {
    const auto path = fmt::format("devices.{}.registers.{}", device.name, entry.name);
    if (!places.usable(path + ".address") || !places.usable(path + ".type")) continue;
    const auto mark = places.mark(path + ".address");
    const int first = entry.address, count = register_count(entry.type);
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

}  // namespace

void check_devices(const Configuration& configuration, Diagnostics& diagnostics, const Places& places) {
  for (const auto& device : configuration.devices) check_registers(device, diagnostics, places);
}

}  // namespace axisd::config
