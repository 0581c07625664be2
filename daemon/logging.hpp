#pragma once

#include <string>

#include "buses/modbus_rtu/rtu_bus.hpp"
#include "daemon/core/observed_port.hpp"

namespace axisd {

/// Logging through a thread of its own, so that no caller ever waits for a pipe or a disk: under systemd to
/// the journal with priorities, else to stderr.
void start_logging(const std::string& level);
void end_logging();

/// What writes the wire log.
struct WireLog {
  modbus_rtu::ExchangeObserver exchanges;
  core::NetworkObserver frames;
};

/// Appends every exchange and every CAN frame to `path`, one line each, times by CLOCK_MONOTONIC:
///   <ns> <bus> tx <hex>            first byte of the request
///   <ns> <bus> rx <hex>            first byte of the reply
///   <ns> <bus> -- <why>            nothing sent or no reply
/// and on CAN, frames as candump writes them:
///   <ns> <bus> tx 605#2B406000...  handed to the interface (the line is written when its fate is known)
///   <ns> <bus> rx 585#...          received
///   <ns> <bus> -- <frame> <why>    not sent; after its tx line: never confirmed
///   <ns> <bus> link <state>        up, down, bus_off, ...
/// Errors: the file cannot be opened.
Result<WireLog> open_wire_log(const std::string& path);

}  // namespace axisd
