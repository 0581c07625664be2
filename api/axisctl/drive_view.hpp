// Drives and their parameters as tables and text. Pure.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "api/axisctl/table.hpp"
#include "axisd/v1/drive_service.pb.h"

namespace axisd::axisctl {

/// Everything known about a drive, a line per item, ending in a line end.
std::string drive_details(const v1::GetDriveResponse& drive);

/// "start_speed" fits "speed" (part of the name) and "*_speed" (shell pattern).
bool fits(const std::string& name, const std::string& pattern);

struct ParameterColumns {
  bool values = false;  ///< with what was read
  bool descriptions = false;
};
/// One row per parameter.
Table parameter_table(const v1::ListParametersResponse& catalogue,
                      const google::protobuf::RepeatedPtrField<v1::ParameterValue>& values,
                      ParameterColumns columns);
/// Values only, with address and unit. `catalogue` may lack them.
Table value_table(const v1::ListParametersResponse& catalogue,
                  const google::protobuf::RepeatedPtrField<v1::ParameterValue>& values);

/// "6041h:00" or "0x604100", an object, or "0x0010", a register; nullopt: it is a name. Throws Failure
/// (usage) for what begins like an address and is none.
std::optional<std::uint32_t> parse_address(std::string_view text);
/// "NAME=VALUE", the value decimal or 0x. Throws Failure (usage).
v1::ParameterValue parse_assignment(std::string_view text);

}  // namespace axisd::axisctl
