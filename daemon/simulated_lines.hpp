#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "buses/error.hpp"
#include "config/configuration.hpp"
#include "daemon/simulated_places.hpp"
#include "devices/simulation/pty_line.hpp"

namespace axisd {

/// The simulated drives behind every bus with `port: sim`, each line on a pty with wire time, so that the
/// same code path is used as for real ones.
class SimulatedLines {
 public:
  /// Errors: no pty can be had; a model without a simulator.
  static Result<std::unique_ptr<SimulatedLines>> open(const config::Configuration& configuration);
  /// What to open for the bus; empty: it is a real one.
  [[nodiscard]] std::string path(const std::string& bus) const;
  /// A command of execute_control() on a simulated line; nothing: the bus is none. Thread: any.
  [[nodiscard]] std::optional<std::string> control(const std::string& bus, std::string_view command) const;
  /// Drives come and go as axes do; one whose place, model or mechanics change is another one, just powered
  /// up. Buses are the same as before.
  void reconfigure(const config::Configuration& configuration,
                   const std::vector<ConfigurationChange>& changes);

 private:
  std::map<std::string, std::unique_ptr<simulation::PtyLine>> lines_;
  SimulatedPlaces places_;
};

/// The mechanics around the drive of one axis, in pulses of the drive from its power-up position.
simulation::SimulatedNodeSettings simulated_node(const config::AxisEntry& entry);

}  // namespace axisd
