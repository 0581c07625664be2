#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "buses/canopen/canopen_bus.hpp"
#include "buses/modbus_rtu/rtu_bus.hpp"
#include "daemon/core/link_cycler.hpp"
#include "devices/axis/stop_delays.hpp"

namespace axisd::core {

/// The wires of one machine. Thread: core.
struct MachineBuses {
  std::map<std::string, StopDelays, std::less<>> stop_delays;  ///< by bus; axes count there
  std::vector<std::unique_ptr<modbus_rtu::RtuBus>> lines;
  std::vector<std::unique_ptr<canopen::CanopenBus>> networks;
  std::vector<std::unique_ptr<LinkCycler>> cyclers;  ///< one per network
  std::vector<Bus*> all;                             ///< of either kind

  /// nullptr if there is none of that name.
  [[nodiscard]] Bus* find(std::string_view bus) const;
  /// The same, if it is an RS-485 line.
  [[nodiscard]] modbus_rtu::RtuBus* find_line(std::string_view bus) const;
  /// The same, if it is a CAN network.
  [[nodiscard]] canopen::CanopenBus* find_network(std::string_view bus) const;
  [[nodiscard]] StopDelays delays_of(std::string_view bus) const;
};

}  // namespace axisd::core
