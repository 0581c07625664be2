// What a daemon says, in words of the command line. Pure.
#pragma once

#include <string>
#include <string_view>

namespace axisd::axisctl {

/// A text of the daemon with axisctl's commands and options in place of calls and their fields: "list them:
/// axisctl list, or ListAxes" is "list them: axisctl list".
[[nodiscard]] std::string in_own_words(std::string_view text);

/// A machine's advice for whoever asks about `subject`, which may be an axis of a cell: "axisctl reset
/// feeder" of press-2/feeder is "axisctl reset press-2/feeder", and "axisctl state" is "axisctl --machine
/// press-2 state".
[[nodiscard]] std::string advice(std::string_view remedy, std::string_view subject);

}  // namespace axisd::axisctl
