// The way to the simulated drives of a daemon on this computer.
#pragma once

#include <chrono>
#include <string>
#include <string_view>

namespace axisd::axisctl {

/// A connection to the socket of one run of the daemon. Thread: one.
class SimulationClient {
 public:
  /// Throws Failure (unreachable): the daemon runs on another computer, belongs to another user, or has no
  /// simulated drives.
  SimulationClient(std::string_view instance_id, std::chrono::nanoseconds timeout);
  SimulationClient(const SimulationClient&) = delete;
  ~SimulationClient();

  /// One command, such as "axis feeder power off". What it replied behind "ok". Throws Failure: refused, or
  /// unreachable.
  [[nodiscard]] std::string ask(std::string_view command) const;

 private:
  int socket_ = -1;
};

}  // namespace axisd::axisctl
