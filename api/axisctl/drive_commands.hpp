// The parts of `axisctl drive`.
#pragma once

#include <cstdint>
#include <string>

#include "api/axisctl/invocation.hpp"

namespace axisd::axisctl {

void add_parameter_commands(CLI::App& drive, Invocation& invocation);  ///< parameters, read, write
void add_segment_command(CLI::App& drive, Invocation& invocation);     ///< segments
void add_serial_commands(CLI::App& drive, Invocation& invocation);     ///< readdress, set-serial

/// The options that what changes a drive for good has: the axis, its name again, and its lease.
struct ConfirmedArguments {
  std::string axis, confirm;
  std::uint64_t lease_token = 0;
};
void add_confirmed(CLI::App& command, ConfirmedArguments& arguments);

}  // namespace axisd::axisctl
