// Following a command until it has ended.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "api/axisctl/invocation.hpp"

namespace axisd::axisctl {

struct Follow {
  std::string unit;             ///< of the axis
  std::optional<double> start;  ///< position before the motion, for the per cent of the way
  bool halt_on_interrupt = false;
  bool several = false;  ///< as JSON a list, however many of the named axes have taken the command
};

/// How much of the way from `start` to `target` lies behind, 0 to 100; nothing if there is no way.
std::optional<double> percent_of_way(std::optional<double> start, std::optional<double> target,
                                     double position);
/// Where a motion ends, if it has an end: the granted or asked position, or the start plus the distance.
std::optional<double> target_of(const v1::Command& command, std::optional<double> start);
/// "feeder  62.5 mm  50 mm/s  [##########          ]  52 %  1.3 s".
std::string progress_text(const v1::AxisState& state, const v1::Command& command,
                          std::optional<double> start);

/// Halts an axis, on the connection that stops have to themselves; repeated for as long as `limit` while the
/// daemon cannot be reached. Throws Failure.
v1::Command halt_axis(Invocation& invocation, const std::string& axis, std::chrono::nanoseconds limit);

/// Follows `command` until it has ended, with a progress line if standard output is a terminal. Prints the
/// result. Returns ok only for Done. Ctrl-C leaves the command alone unless `halt_on_interrupt`. Throws
/// Failure.
ExitCode follow(Invocation& invocation, const v1::Command& command, const Follow& options);

/// Prints what became of commands that run at the same time; `wait`: follows one after the other. Returns the
/// first that is not ok.
ExitCode report(Invocation& invocation, const std::vector<v1::Command>& commands, bool wait,
                const Follow& options);

/// What an ended command means for the exit status; one that goes on is ok.
ExitCode outcome(const v1::Command& command);

}  // namespace axisd::axisctl
