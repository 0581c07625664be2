#pragma once

#include <csignal>

#include "api/server/door_check.hpp"
#include "api/server/lane/stop_lane.hpp"
#include "api/server/server.hpp"
#include "daemon/configuration_service.hpp"
#include "daemon/core/core_loop.hpp"
#include "daemon/core/machine_core.hpp"

namespace axisd {

/// What has to make progress; all of it outlives the supervision.
struct Supervised {
  core::CoreLoop& loop;
  const core::MachineCore& machine;
  const server::Server& server;
  const server::StopLane& stop_lane;
  server::DoorCheck& doors;
  ConfigurationService& served;
};

/// Those that supervise() takes: every thread of the process has them blocked.
[[nodiscard]] sigset_t ending_signals();

/// Tells systemd that all of it lives (buses/supervision.hpp), until a signal asks for the end: which one.
/// SIGHUP reloads. Thread: first.
[[nodiscard]] int supervise(const Supervised& parts);

}  // namespace axisd
