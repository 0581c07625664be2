// What the programs beside the daemon have in common: how they log, and how they end.
#pragma once

#include <string>

#include "buses/error.hpp"

namespace axisd::program {

/// Exit status: it could not go on; what it was told is wrong.
inline constexpr int failed = 1, wrong = 2;

/// Logs to stderr on a thread of its own: whoever does not read the log holds up nothing. `level`: as spdlog
/// names it, or warn. What gRPC says is left out unless GRPC_VERBOSITY is set, as anybody can make it say
/// much.
void start_logging(const std::string& name, const std::string& level);

/// Ends the process with its log written. gRPC's threads, and what is open, may still want something of what
/// would be torn down.
[[noreturn]] void leave_at_once(int status);

/// One line on stderr. The exit status to end with.
int give_up(const std::string& name, const Error& error);

}  // namespace axisd::program
