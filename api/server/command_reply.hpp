// Commands as answers.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "api/server/reply.hpp"
#include "axisd/v1/types.pb.h"
#include "devices/machine.hpp"

namespace axisd::server {

/// The callback that ends `call` with the command in `to` (part of its response), or with the error's status.
/// Logs `what` for people; what only renews a motion that was accepted before `called` is logged for
/// debugging. `what` must be a literal. `also` (may be empty) fills the rest of the response.
[[nodiscard]] Machine::CommandCallback reply_with_command(ReplyPtr call, v1::Command* to, std::string client,
                                                          std::string subject, std::string_view what,
                                                          std::function<void()> also = {},
                                                          std::optional<WallTime> called = {});

}  // namespace axisd::server
