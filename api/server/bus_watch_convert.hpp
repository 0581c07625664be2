// The traffic on a bus as messages. No decisions are made here.
#pragma once

#include <string>

#include "axisd/v1/bus_service.pb.h"
#include "devices/bus_watch.hpp"

namespace axisd::server {

void to_proto(const BusStatistics& from, v1::BusStatistics& to);
void to_proto(const TraceBatch& from, const std::string& bus, v1::TraceBusResponse& to);
void to_proto(const FlightRecord& from, v1::FlightRecord& to);

}  // namespace axisd::server
