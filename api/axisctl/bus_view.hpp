// Buses as text for people. Pure.
#pragma once

#include <string>

#include "api/axisctl/error.hpp"
#include "api/axisctl/table.hpp"
#include "axisd/v1/bus_service.pb.h"

namespace axisd::axisctl {

/// The RS-485 lines and what went over them.
Table line_table(const v1::ListBusesResponse& buses);
/// The CAN networks likewise.
Table network_table(const v1::ListBusesResponse& buses);
/// What to tell of a name that no bus has.
Failure no_such_bus(const std::string& name, const v1::ListBusesResponse& buses);
[[nodiscard]] bool is_network(const v1::Bus& bus);
/// "up", "bus off", or "open"; with why it is not, and "simulated".
std::string bus_state(const v1::Bus& bus);
/// All that is known of one bus, a line for each.
std::string bus_details(const v1::Bus& bus);
/// What an object holds: hexadecimal as it was sent, as numbers, and as text if it is one.
Table object_table(std::uint32_t address, const v1::TransactResponse& object);

}  // namespace axisd::axisctl
