// Checks of event requests.
#pragma once

#include "api/server/event_stream.hpp"

namespace axisd::server {

/// Axes and kinds must exist; the cursor is that of this run of the daemon, or chosen as the contract says.
/// Errors: invalid_argument, unknown_axis.
[[nodiscard]] Result<EventQuery> event_query(const v1::WatchEventsRequest& from, Machine& machine);

}  // namespace axisd::server
