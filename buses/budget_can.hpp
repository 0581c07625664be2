// The budget of a CANopen network. Pure.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "buses/budget.hpp"
#include "buses/canopen/settings.hpp"
#include "buses/transaction_set.hpp"

namespace axisd::canopen {

struct AxisDemand {
  std::string name;
  std::uint8_t node = 1;
  CanTransactionSet set{};
  Duration poll_moving{}, poll_idle{};  ///< > 0
  Duration continuity_period{};         ///< of the canary; > 0
  Duration drift_check{};               ///< > 0
};

/// A node that is not an axis: its objects are read one after the other.
struct DeviceDemand {
  std::uint8_t node = 1;
  int transfers = 0;
  Duration poll{};
};

struct NetworkDemand {
  NetworkSettings network;
  std::vector<AxisDemand> axes;
  std::vector<DeviceDemand> devices{};
  std::size_t window = 4;  ///< frames handed over and not yet confirmed, at most (can::PortSettings)
  /// No drive takes the PDOs that it should have: states are polled and stops go out by SDO.
  bool by_sdo = false;
};

BusBudget budget_of(const NetworkDemand& demand);

}  // namespace axisd::canopen
