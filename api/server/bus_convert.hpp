// Nodes and what was found on a bus as messages. No decisions are made here.
#pragma once

#include "axisd/v1/bus_service.pb.h"
#include "devices/bus_access.hpp"
#include "devices/machine.hpp"

namespace axisd::server {

void to_proto(const NetworkStatus& from, v1::NetworkStatus& to);
void to_proto(const BusStatus& from, v1::Bus& to);
void to_proto(const DeviceSnapshot& from, v1::Device& to);
void to_proto(const FoundNode& from, v1::FoundNode& to);
void to_proto(const ScanProgress& from, v1::ScanResponse& to);
/// What an object holds, and its number as `type` reads it.
void to_proto(const std::vector<std::uint8_t>& bytes, v1::ParameterType type, v1::TransactResponse& to);

}  // namespace axisd::server
