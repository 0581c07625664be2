#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "buses/clock.hpp"
#include "buses/modbus_rtu/line.hpp"
#include "buses/task.hpp"
#include "config/configuration.hpp"

namespace axisd::core {

struct QuiesceReport {
  std::string axis;
  bool confirmed = false;  ///< standstill was read back after the stop
  std::string detail;      ///< for people
};

/// Last resort (M17): stops every drive of a configuration without axes, leases or server. Each gets stops
/// until its standstill is read back or `limit` has passed; one that goes on gets quick stops after half of
/// it. Thread: core.
Task<std::vector<QuiesceReport>> quiesce(
    Executor executor, Clock& clock, const config::Configuration& configuration,
    std::function<std::unique_ptr<modbus_rtu::Line>(const modbus_rtu::LineSettings&)> make_line,
    Duration limit);

}  // namespace axisd::core
