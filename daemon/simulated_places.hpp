#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "config/configuration.hpp"
#include "devices/configuration_change.hpp"

namespace axisd {

/// Where the simulated drive of each axis is, and which of them a new configuration makes another drive.
class SimulatedPlaces {
 public:
  struct Place {
    std::string bus;
    std::uint8_t node = 0;
  };
  /// All that the configuration has, on whatever bus.
  void set(const config::Configuration& configuration);
  /// Tells first all places that become free, then all drives that are new; and knows them from then on.
  void change(const config::Configuration& configuration, const std::vector<ConfigurationChange>& changes,
              const std::function<void(const Place&)>& remove,
              const std::function<void(const config::AxisEntry&)>& add);

 private:
  std::map<std::string, Place> places_;  ///< by axis
};

}  // namespace axisd
