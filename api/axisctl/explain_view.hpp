// What stands in the way of a command, as text. Pure.
#pragma once

#include <string>
#include <string_view>

#include "axisd/v1/system_service.pb.h"

namespace axisd::axisctl {

/// Is anything among it that a command would be refused for?
bool is_blocked(const v1::ExplainResponse& response);
/// A verdict, then two lines for each obstacle: what it is, and what to do about it. `command` is the word of
/// the command line ("move"), or empty for motion in general.
std::string explanation(const v1::ExplainResponse& response, std::string_view axis, std::string_view command,
                        bool colour);

}  // namespace axisd::axisctl
