// Nodes and what was found on a bus as messages. No decisions are made here.
#pragma once

#include "axisd/v1/bus_service.pb.h"
#include "devices/bus_access.hpp"

namespace axisd::server {

void to_proto(const DeviceSnapshot& from, v1::Device& to);
void to_proto(const FoundNode& from, v1::FoundNode& to);
void to_proto(const ScanProgress& from, v1::ScanResponse& to);

}  // namespace axisd::server
