// The parts of `axisctl bus`.
#pragma once

#include "api/axisctl/invocation.hpp"

namespace axisd::axisctl {

void add_scan_command(CLI::App& bus, Invocation& invocation);

}  // namespace axisd::axisctl
