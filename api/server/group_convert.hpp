// Groups: requests to domain values, and domain values to messages.
#pragma once

#include "axisd/v1/group_service.pb.h"
#include "devices/machine.hpp"

namespace axisd::server {

/// Errors: invalid_argument, out_of_range, naming the field.
[[nodiscard]] Result<GroupMoveRequest> to_request(const v1::MoveGroupRequest& from);
/// Errors: as of the move; invalid_argument: it says how long to wait.
[[nodiscard]] Result<GroupMoveRequest> to_request(const v1::PrepareMoveRequest& from);
/// Errors: invalid_argument.
[[nodiscard]] Result<GroupStartRequest> to_request(const v1::StartPreparedRequest& from, std::string client);
/// A moment of the machine's clock.
void to_proto(TimePoint from, google::protobuf::Duration& to);
/// Of a stop or a release of nothing: invalid_argument.
[[nodiscard]] Error nothing_named();
void to_proto(const GroupSettings& from, v1::Group& to);
void to_proto(const GroupPreparation& from, v1::Preparation& to);
void to_proto_without_members(const GroupMove& from, v1::GroupMove& to);
void to_proto(const GroupMove& from, v1::GroupMove& to);
void to_proto(const GroupStopResult& from, v1::GroupStopResult& to);
void to_proto(const GroupReleaseResult& from, v1::GroupReleaseStopResult& to);

}  // namespace axisd::server
