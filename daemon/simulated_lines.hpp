#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>

#include "buses/error.hpp"
#include "config/configuration.hpp"
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

 private:
  std::map<std::string, std::unique_ptr<simulation::PtyLine>> lines_;
};

/// The mechanics around the drive of one axis, in pulses of the drive from its power-up position.
simulation::SimulatedNodeSettings simulated_node(const config::AxisEntry& entry);

}  // namespace axisd
