// The configuration that a machine is served from, as the API shows it.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "buses/clock.hpp"

namespace axisd {

/// What was read when the daemon started, whatever the file holds by now.
struct ServedConfiguration {
  std::string yaml;
  std::string path;      ///< as the daemon was given it
  std::string revision;  ///< of the text: equal texts have equal ones
  WallTime served_since{};
};

struct ConfigurationFinding {
  std::uint32_t line = 0, column = 0;  ///< 1-based; 0: of the file as a whole
  std::string message;                 ///< with the offending text
  std::string suggestion;              ///< empty if there is none
};

struct ConfigurationCheck {
  std::vector<ConfigurationFinding> findings;  ///< in the order of the file; none: it could be served
  std::string revision;
};

/// Thread: any.
class ConfigurationAccess {
 public:
  virtual ~ConfigurationAccess() = default;
  [[nodiscard]] virtual const ServedConfiguration& served() const = 0;
  /// Checks a text as a start of the daemon would, with relative paths in it counting from the served file.
  /// Takes milliseconds. Opens no port.
  [[nodiscard]] virtual ConfigurationCheck check(std::string_view yaml) const = 0;
};

}  // namespace axisd
