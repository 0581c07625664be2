// What an axis shares with the rest of its machine.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "buses/bus.hpp"
#include "buses/clock.hpp"
#include "buses/task.hpp"
#include "devices/axis/command_book.hpp"
#include "devices/axis/stop_delays.hpp"
#include "devices/axis/stop_holds.hpp"
#include "devices/event.hpp"
#include "devices/lease/lease_table.hpp"
#include "devices/persistence.hpp"

namespace axisd {

struct AxisEnvironment {
  Executor executor;
  Clock* clock = nullptr;
  Bus* bus = nullptr;
  CommandBook* book = nullptr;
  Persistence* persistence = nullptr;
  const LeaseTable* leases = nullptr;
  const bool* inhibited = nullptr;  ///< StopAll is latched
  /// Motion is refused with it; nothing in it: the state is accepted.
  const std::optional<Error>* state_unaccepted = nullptr;
  const StopHolds* holds = nullptr;   ///< of this axis; they outlive it
  StopDelays* stop_delays = nullptr;  ///< of its bus, where its stops are counted; may be null
  std::function<void()> published;    ///< after each new snapshot
  std::function<void(const std::string& axis, EventContent)> event{};
};

}  // namespace axisd
