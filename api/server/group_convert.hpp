// Groups: requests to domain values, and domain values to messages.
#pragma once

#include "axisd/v1/group_service.pb.h"
#include "devices/machine.hpp"

namespace axisd::server {

/// Errors: invalid_argument, out_of_range, naming the field.
[[nodiscard]] Result<GroupMoveRequest> to_request(const v1::MoveGroupRequest& from);
/// Of a stop or a release of nothing: invalid_argument.
[[nodiscard]] Error nothing_named();
void to_proto(const GroupSettings& from, v1::Group& to);
void to_proto(const GroupMove& from, v1::GroupMove& to);
void to_proto(const GroupStopResult& from, v1::GroupStopResult& to);
void to_proto(const GroupReleaseResult& from, v1::GroupReleaseStopResult& to);

}  // namespace axisd::server
