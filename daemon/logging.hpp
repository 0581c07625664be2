#pragma once

#include <string>

#include "buses/modbus_rtu/rtu_bus.hpp"

namespace axisd {

/// Logging through a thread of its own, so that no caller ever waits for a pipe or a disk: under systemd to
/// the journal with priorities, else to stderr.
void start_logging(const std::string& level);
void end_logging();

/// Appends every exchange to `path`, one line each:
///   <ns> <bus> tx <hex>            first byte of the request, CLOCK_MONOTONIC
///   <ns> <bus> rx <hex>            first byte of the reply
///   <ns> <bus> -- <why>            nothing sent or no reply
/// Errors: the file cannot be opened.
Result<modbus_rtu::ExchangeObserver> open_wire_log(const std::string& path);

}  // namespace axisd
