// Lines of the log that clients and strangers cause.
#pragma once

#include <fmt/format.h>
#include <spdlog/common.h>

#include <string_view>

#include "buses/clock.hpp"
#include "buses/log_about.hpp"

namespace axisd {

/// Writes "WHO: TEXT", unless there are many of this kind by the same (Ration); then tell_left_out() says
/// "WHO: KIND: 12 more like this in the last 10 s". For what somebody can cause as often as he likes, also
/// without any right. `text` is made in any case. Never waits for the log, and for other threads only while
/// they look up an origin. `about` and `subject`: as of log_about(). Thread: any.
void log_limited(spdlog::level::level_enum level, std::string_view who, std::string_view kind,
                 std::string_view text, LogKind about = LogKind::none, const LogSubject& subject = {});

/// Writes what has been left out in periods that are over. When it wants to be called again, a period ahead
/// at most. Thread: any, meant for one.
TimePoint tell_left_out(TimePoint now);

}  // namespace axisd
