// The parts of `axisctl bus`.
#pragma once

#include "api/axisctl/invocation.hpp"

namespace axisd::axisctl {

/// bus list, buses: one table for each kind of bus.
void list_buses(Invocation& invocation);
void add_scan_command(CLI::App& bus, Invocation& invocation);
void add_watch_commands(CLI::App& bus, Invocation& invocation);  ///< statistics, records

}  // namespace axisd::axisctl
