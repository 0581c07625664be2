// Axis states as tables and text. Pure.
#pragma once

#include <google/protobuf/message.h>
#include <google/protobuf/repeated_ptr_field.h>

#include <string>
#include <string_view>
#include <vector>

#include "api/axisctl/table.hpp"
#include "axisd/v1/axis_service.pb.h"
#include "axisd/v1/types.pb.h"

namespace axisd::axisctl {

/// One row per axis. What its drive never said is "-".
Table axis_table(const google::protobuf::RepeatedPtrField<v1::AxisState>& axes);
/// Everything known about one axis, a line per item, ending in a line end.
std::string state_details(const v1::AxisState& state, bool colour);
/// A whole batch in one line: "12  feeder Standstill 0 mm 0 mm/s  turntable Offline 10 deg 0 deg/s".
std::string tick_line(const v1::WatchAxesResponse& batch);
/// The same, of chosen fields: a column each.
Table field_table(const google::protobuf::RepeatedPtrField<v1::AxisState>& axes,
                  const std::vector<std::string>& fields);
/// A whole batch in one line: "12  feeder position=0 velocity=0  turntable position=10 velocity=0".
std::string field_line(const v1::WatchAxesResponse& batch, const std::vector<std::string>& fields);
/// The same as a line of JSON, with what was asked for also where it is 0.
std::string field_json(const v1::WatchAxesResponse& batch, const std::vector<std::string>& fields);
/// A field by its path, "fault.message", as text: words for enums, JSON for messages; "-" where it is not
/// set.
std::string field_text(const google::protobuf::Message& message, std::string_view path);
/// What a person should know beside the state: "simulated, alarm 3 overcurrent, all stopped".
std::string remarks(const v1::AxisState& state);

}  // namespace axisd::axisctl
