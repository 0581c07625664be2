// What is known about drives as messages. No decisions are made here.
#pragma once

#include <string_view>
#include <vector>

#include "axisd/v1/drive_service.pb.h"
#include "devices/machine.hpp"

namespace axisd::server {

[[nodiscard]] v1::ParameterAccess to_proto(Access access);
[[nodiscard]] v1::AlarmReset to_proto(AlarmReset reset);
[[nodiscard]] v1::SerialPhase to_proto(SerialProgress::Phase phase);

/// `configured_by`: key of the configuration that decides it, or empty.
void to_proto(const ParameterSpec& from, std::string_view configured_by, v1::Parameter& to);
/// The whole catalogue of `from.descriptor`, which is set.
void to_proto(const DriveInfo& from, v1::ListParametersResponse& to);
void to_proto(std::string_view axis, const DriveInfo& from, v1::GetDriveResponse& to);
/// Values with the names that the model gives their addresses.
void to_proto(const std::vector<ParameterValue>& from, const DriveDescriptor& model,
              google::protobuf::RepeatedPtrField<v1::ParameterValue>& to);
void to_proto(const SegmentSettings& from, v1::SegmentTable& to);

}  // namespace axisd::server
