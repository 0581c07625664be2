#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "buses/budget.hpp"
#include "buses/clock.hpp"

namespace axisd::canopen {

/// One CANopen network as the YAML describes it.
struct NetworkSettings {
  std::string name;                                       ///< bus name
  std::string interface;                                  ///< network interface ("can0"), or "sim"
  std::uint32_t bitrate = 1'000'000;                      ///< bit/s; the interface's must be the same
  Duration sync_period{};                                 ///< of the SYNC that this master produces; 0: none
  Duration sdo_timeout = std::chrono::milliseconds(100);  ///< from the end of a request to its reply
  Duration sdo_answer = std::chrono::milliseconds(5);  ///< of a node, as a rule: what starts are checked by
  BudgetPolicy budget{};
  [[nodiscard]] bool simulated() const { return interface == "sim"; }
};

}  // namespace axisd::canopen
