// The bus budget as it is shown: what was computed, beside what was seen.
#pragma once

#include <string>
#include <vector>

#include "buses/budget.hpp"
#include "devices/bus_kind.hpp"

namespace axisd {

/// Longest times seen since the daemon started; 0: not seen yet. Those of stops begin with the request's
/// arrival at the server, and include the motor's way.
struct ObservedAxis {
  Duration refresh_idle{}, refresh_moving{};
  Duration stop_frame{}, standstill{};          ///< of this axis alone, or of some
  Duration stop_frame_all{}, standstill_all{};  ///< of all axes
};

struct AxisBudgetReport {
  AxisBudget predicted;
  Duration deceleration{};  ///< by the limits, from the highest velocity
  std::string unit;
  /// From the stop request on at the highest velocity, at most; user units; may be infinite.
  double way_alone = 0, way_all = 0;
  ObservedAxis observed{};
};

/// A demand of the configuration that the bus does not meet.
struct BudgetExcess {
  std::string key;   ///< of the bus that demands it: "stop_bound"; "budget": no key of its own
  std::string text;  ///< what exceeds what
  std::string remedy;
};

struct BusBudgetReport {
  BusKind kind = BusKind::modbus_rtu;
  BudgetPolicy policy;
  BusBudget predicted;
  std::vector<AxisBudgetReport> axes;
  std::vector<BudgetExcess> excess;
};

}  // namespace axisd
