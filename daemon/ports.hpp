#pragma once

#include <memory>

#include "buses/can/port.hpp"
#include "buses/canopen/settings.hpp"
#include "buses/modbus_rtu/line.hpp"
#include "config/configuration.hpp"
#include "daemon/core/core_loop.hpp"
#include "daemon/core/link_client.hpp"
#include "daemon/core/link_cycler.hpp"
#include "daemon/simulated_lines.hpp"
#include "daemon/simulated_networks.hpp"
#include "daemon/simulation_control.hpp"

namespace axisd {

/// Makes what carries the frames of each bus: the operating system's ports and interfaces, or simulated
/// drives. Outlives the buses, and is outlived by the loop. Thread: its makers are called on the core thread,
/// or before that runs.
class Ports {
 public:
  /// Errors: as of SimulatedLines and SimulatedNetworks.
  static Result<std::unique_ptr<Ports>> open(core::CoreLoop& loop, const config::Configuration& configuration,
                                             const std::string& link_helper);
  Ports(const Ports&) = delete;

  std::unique_ptr<modbus_rtu::Line> make_line(const modbus_rtu::LineSettings& settings);
  std::unique_ptr<can::Port> make_port(const canopen::NetworkSettings& settings);
  [[nodiscard]] core::LinkHelper link_helper();
  [[nodiscard]] SimulationControl& simulation() { return *simulation_; }
  /// Simulated drives follow the configuration.
  void reconfigure(const config::Configuration& configuration,
                   const std::vector<ConfigurationChange>& changes);

 private:
  Ports(core::CoreLoop& loop, const std::string& link_helper);

  core::CoreLoop* loop_;
  core::LinkClient link_client_;
  std::unique_ptr<SimulatedLines> lines_;
  std::unique_ptr<SimulatedNetworks> networks_;
  std::unique_ptr<SimulationControl> simulation_;
};

}  // namespace axisd
