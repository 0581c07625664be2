// The budget of an RS-485 line. Pure.
#pragma once

#include <optional>
#include <vector>

#include "buses/budget.hpp"
#include "buses/modbus_rtu/settings.hpp"
#include "buses/transaction_set.hpp"

namespace axisd::modbus_rtu {

struct AxisDemand {
  std::string name;
  RtuTransactionSet set{};
  Duration poll_moving{}, poll_idle{};       ///< > 0
  Duration poll_fastest{};                   ///< where the end of a motion is awaited; > 0
  Duration quiet_before_end{};               ///< of a motion, if that is more than poll_moving
  Duration continuity_period{};              ///< of the canary; > 0
  Duration drift_check{};                    ///< > 0
  bool segments = false;                     ///< the configuration owns its segment table, too
  std::optional<Duration> turnaround_max{};  ///< of this drive; nothing: the line's
};

/// A node that is not an axis: read block by block, in class `parameters`.
struct DeviceDemand {
  std::vector<ExchangeSize> blocks;
  Duration poll{};
  std::optional<Duration> turnaround_max{};  ///< of this node; nothing: the line's
};

/// What is asked of one line.
struct LineDemand {
  LineSettings line;
  std::vector<AxisDemand> axes;
  std::vector<DeviceDemand> devices{};
  /// So many may answer nothing at all where axes are read; bounds of stops hold with any number of them.
  int silent_nodes = 1;
};

/// Holds for any pattern of requests that keeps to the demand. Never fails.
BusBudget budget_of(const LineDemand& demand);

}  // namespace axisd::modbus_rtu
