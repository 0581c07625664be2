#pragma once

#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "config/configuration.hpp"
#include "daemon/core/core_loop.hpp"
#include "daemon/simulated_lines.hpp"
#include "daemon/simulated_networks.hpp"

namespace axisd {

/// What somebody does to the simulated drives of this daemon by hand: `axisctl sim`. Real drives are out of
/// its reach.
class SimulationControl {
 public:
  /// All outlive it.
  SimulationControl(core::CoreLoop& loop, SimulatedLines& lines, SimulatedNetworks& networks,
                    const config::Configuration& configuration);

  /// One of these, with the name of an axis or bus:
  ///   axis NAME COMMAND (axis_command()); bus NAME cut|join (its cable); bus NAME clear (faults that wait)
  /// Replies "ok ..." or "error ...". Thread: any but the core, which must run.
  std::string execute(std::string_view line);
  /// Thread: any.
  void reconfigure(const config::Configuration& configuration);

 private:
  std::string on_axis(std::string_view name, std::string_view command);
  std::string on_bus(std::string_view name, std::string_view command);
  /// A command of execute_control().
  std::string on_network(const std::string& bus, const std::string& command);

  core::CoreLoop* loop_;
  SimulatedLines* lines_;
  SimulatedNetworks* networks_;
  std::vector<std::string> buses_;  ///< all, simulated or not; a reload never changes them
  std::mutex mutex_;                ///< for axes_
  std::vector<config::AxisEntry> axes_;
};

/// Where `axisctl sim` finds that of a run of the daemon, on the same computer.
std::string simulation_socket(std::string_view instance_id);

}  // namespace axisd
