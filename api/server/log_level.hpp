// The level of the daemon's log, as the API names it.
#pragma once

#include <string>
#include <string_view>

#include "axisd/v1/system_service.pb.h"

namespace axisd::server {

/// Thread: any.
[[nodiscard]] v1::LogLevel log_level();

/// The line that tells of it stands in the log whichever of both levels is the more talkative one. What was
/// done, for people. Precondition: `after` is one of the levels. Thread: any.
std::string change_log_level(v1::LogLevel before, v1::LogLevel after, std::string_view client);

}  // namespace axisd::server
