// How one configuration of a machine differs from another.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace axisd {

enum class ConfigurationChangeKind : std::uint8_t { added, removed, changed };

/// One part of the file that has another meaning than before: comments, order and spelling are no change.
struct ConfigurationChange {
  using Kind = ConfigurationChangeKind;
  std::string
      section;       ///< "axes", "buses", "devices", "groups"; else the key at the top of the file: "leases"
  std::string name;  ///< of the axis, bus, device or group; empty: it is the section itself
  Kind kind = Kind::changed;
  std::vector<std::string>
      keys{};  ///< of `changed`, as in the file ("limits.velocity"); empty: a single value
  bool operator==(const ConfigurationChange&) const = default;

  /// "axes.feeder", "leases".
  [[nodiscard]] std::string path() const { return name.empty() ? section : section + "." + name; }
};

/// "axes.feeder changed (limits.velocity, scale.invert)".
std::string to_string(const ConfigurationChange& change);

}  // namespace axisd
