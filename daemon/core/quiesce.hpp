#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "buses/can/port.hpp"
#include "buses/clock.hpp"
#include "buses/modbus_rtu/line.hpp"
#include "buses/task.hpp"
#include "config/configuration.hpp"
#include "daemon/core/link_cycler.hpp"

namespace axisd::core {

struct QuiesceReport {
  std::string axis;
  bool confirmed = false;  ///< standstill was read back after the stop
  std::string detail;      ///< for people
};

/// What its buses are made from; as in MachineParts.
struct QuiesceParts {
  Executor executor;
  Clock* clock = nullptr;
  std::function<std::unique_ptr<modbus_rtu::Line>(const modbus_rtu::LineSettings&)> make_line;
  std::function<std::unique_ptr<can::Port>(const canopen::NetworkSettings&)> make_port{};
  LinkHelper link_helper{};
};

/// Last resort (M17): stops every drive of a configuration without axes, leases or server. Each gets stops
/// until its standstill is read back or `limit` has passed; one that goes on gets quick stops after half of
/// it. A CAN link that does not send is cycled, which flushes its queue (M26). Thread: core.
Task<std::vector<QuiesceReport>> quiesce(QuiesceParts parts, const config::Configuration& configuration,
                                         Duration limit);

}  // namespace axisd::core
