#include "devices/configuration_change.hpp"

#include <fmt/ranges.h>

namespace axisd {

std::string to_string(const ConfigurationChange& change) {
  switch (change.kind) {
    case ConfigurationChangeKind::added:
      return change.path() + " added";
    case ConfigurationChangeKind::removed:
      return change.path() + " removed";
    case ConfigurationChangeKind::changed:
      break;
  }
  if (change.keys.empty()) return change.path() + " changed";
  return fmt::format("{} changed ({})", change.path(), fmt::join(change.keys, ", "));
}

}  // namespace axisd
