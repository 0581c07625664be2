#pragma once

#include <string>

#include "daemon/core/bus_recorder.hpp"

namespace axisd {

/// Logging through a thread of its own, so that no caller ever waits for a pipe or a disk: under systemd to
/// the journal with priorities, else to stderr.
void start_logging(const std::string& level);
void end_logging();

/// Appends every frame to `path`, one line each, as append_line() has them (buses/traced_frame.hpp). Errors:
/// the file cannot be opened.
Result<core::FrameObserver> open_wire_log(const std::string& path);

}  // namespace axisd
