// Segment tables as text. Pure.
#pragma once

#include <string>
#include <string_view>

#include "api/axisctl/table.hpp"
#include "axisd/v1/drive_service.pb.h"

namespace axisd::axisctl {

/// "NUMBER:TARGET:VELOCITY[:TIME]", such as "1:50mm:20mm/s:100ms". Throws Failure (usage).
v1::PositionSegment parse_position_segment(std::string_view text, std::string_view unit);
/// "NUMBER:VELOCITY[:TIME]". Throws Failure (usage).
v1::VelocitySegment parse_velocity_segment(std::string_view text, std::string_view unit);
/// A SegmentTable in JSON, as `--json drive segments` prints it. Throws Failure (usage).
v1::SegmentTable parse_segment_json(const std::string& text, std::string_view what);

/// One row per number.
Table segment_table(const v1::SegmentTable& segments, std::string_view unit);

}  // namespace axisd::axisctl
