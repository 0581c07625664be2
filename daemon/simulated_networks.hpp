#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "buses/can/network.hpp"
#include "buses/error.hpp"
#include "config/configuration.hpp"
#include "daemon/simulated_places.hpp"

namespace axisd {

/// The simulated drives behind every bus with `interface: sim`, each network in this process with the times
/// of a wire. Thread: core, on which the drives run, too.
class SimulatedNetworks {
 public:
  /// `clock` outlives it. Errors: a model without a simulator.
  static Result<std::unique_ptr<SimulatedNetworks>> open(Clock& clock,
                                                         const config::Configuration& configuration);
  ~SimulatedNetworks();
  SimulatedNetworks(const SimulatedNetworks&) = delete;

  /// nullptr: the bus is a real one.
  [[nodiscard]] can::Network* find(const std::string& bus) const;
  /// A command of execute_control() on a simulated network; nothing: the bus is none.
  [[nodiscard]] std::optional<std::string> control(const std::string& bus, std::string_view command) const;
  /// As of SimulatedLines.
  void reconfigure(const config::Configuration& configuration,
                   const std::vector<ConfigurationChange>& changes);

 private:
  struct One;
  SimulatedNetworks();
  std::map<std::string, std::unique_ptr<One>> networks_;
  SimulatedPlaces places_;
};

}  // namespace axisd
