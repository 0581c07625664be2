// A configuration as keys and values, for comparing two of them.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "config/configuration.hpp"
#include "devices/configuration_change.hpp"

namespace axisd::config {

/// One axis, bus, device or group, or one section at the top of the file: all that it says, by key.
struct Section {
  std::string section, name;  ///< as of ConfigurationChange
  /// By key as in the file, without the section's own ("limits.velocity"). As text: equal exactly for equal
  /// meanings, defaults included.
  std::map<std::string, std::string> fields{};
};

/// Everything that a configuration says, in the order of the file's sections. A copy, because the schema
/// leads to where values are stored.
std::vector<Section> sections(Configuration configuration);

/// What `after` says otherwise than `before`: nothing for two spellings of the same.
std::vector<ConfigurationChange> differences(const Configuration& before, const Configuration& after);

}  // namespace axisd::config
