// Which stops a client holds, and which it wants to release.
#pragma once

#include <string>

#include "axisd/v1/axis_service.pb.h"
#include "axisd/v1/group_service.pb.h"
#include "devices/axis/stop_holds.hpp"
#include "devices/machine.hpp"

namespace axisd::server {

/// What a client gives as its own id of a stop that it holds: anything unusable counts as none.
[[nodiscard]] std::string hold_id(const std::string& request_id);

/// Which holds are to end. Errors: invalid_argument.
[[nodiscard]] Result<HoldRelease> release_of(const v1::ReleaseStopRequest& from, std::string client);
[[nodiscard]] Result<HoldRelease> release_of(const v1::GroupReleaseStopRequest& from, std::string client);

}  // namespace axisd::server
