// Statistics of a bus as text for people. Pure.
#pragma once

#include <string>
#include <vector>

#include "api/axisctl/table.hpp"
#include "axisd/v1/bus_service.pb.h"

namespace axisd::axisctl {

/// What `share` (0..1) of all took at most, in seconds, as far as the buckets tell; 0 of nothing.
double percentile(const v1::LatencyHistogram& histogram, double share);
/// "line-a: occupied 12.5 % of the last 10 s, 8 % of 3 min 5 s since the start", and what is held back.
std::string load_line(const v1::BusStatistics& bus);
/// What waited and went out, per class.
Table class_table(const v1::BusStatistics& bus);
/// Of an RS-485 line.
Table line_node_table(const v1::BusStatistics& bus);
/// Of a CAN network.
Table network_node_table(const v1::BusStatistics& bus);
/// All of it, bus after bus; the rest as Table::lines() has it.
std::vector<std::string> statistics_lines(const google::protobuf::RepeatedPtrField<v1::BusStatistics>& buses,
                                          bool colour, int columns = 0, TooWide too_wide = TooWide::clip);

}  // namespace axisd::axisctl
