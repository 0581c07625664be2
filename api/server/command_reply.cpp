#include "api/server/command_reply.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <utility>

#include "api/server/convert.hpp"
#include "api/server/status.hpp"
#include "buses/limited_log.hpp"

namespace axisd::server {
namespace {

bool is_repeat(const Command& command, const std::optional<WallTime>& called) {
  return called && command.accepted_at < *called;
}

/// Three times in each hold, for as long as somebody jogs.
bool is_renewal(const Command& command, const std::optional<WallTime>& called) {
  const bool renewable = command.kind == CommandKind::jog || command.kind == CommandKind::move_velocity;
  return renewable && !ended(command.state) && is_repeat(command, called);
}

/// Lines of each kind are limited. Each command is in the audit, and one that fails has a line of its own:
/// journald takes so many lines of a service, and whom hundreds of axes index for must not have it leave out
/// the warnings among them.
std::string_view kind_of_line(const Command& command, const std::optional<WallTime>& called) {
  if (is_repeat(command, called)) return "repeated calls";
  const bool stops = command.kind == CommandKind::halt || command.kind == CommandKind::stop ||
                     command.kind == CommandKind::quick_stop || command.kind == CommandKind::disable;
  return stops ? "stops" : "commands";
}

void log(std::string_view client, std::string_view subject, std::string_view what,
         const Result<Command>& result, const std::optional<WallTime>& called) {
  if (!result) {
    // A command that is cancelled is named by its id.
    const LogSubject refused = what == "cancel" ? LogSubject{.client = client, .command = subject}
                                                : LogSubject{.axis = subject, .client = client};
    return log_limited(spdlog::level::info, client, "refused calls",
                       fmt::format("{} {} refused: {}", subject, what, to_string(result.error())),
                       LogKind::command_refused, refused);
  }
  const auto level = is_renewal(*result, called) ? spdlog::level::debug : spdlog::level::info;
  const auto text = fmt::format("{} {} {} ({}){}", subject, what, to_string(result->state), result->id,
                                result->cause ? ": " + to_string(*result->cause) : std::string());
  const bool failed = result->state == CommandState::error || result->state == CommandState::unknown;
  const auto about = failed ? LogKind::command_failed : LogKind::command_accepted;
  const LogSubject about_it{.axis = result->axis, .client = client, .command = result->id};
  log_limited(level, client, kind_of_line(*result, called), text, about, about_it);
}

}  // namespace

Machine::CommandCallback reply_with_command(ReplyPtr call, v1::Command* to, std::string client,
                                            std::string subject, std::string_view what,
                                            std::function<void()> also, std::optional<WallTime> called) {
  return [call = std::move(call), to, client = std::move(client), subject = std::move(subject), what,
          also = std::move(also), called](Result<Command> result) {
    // On the core thread: nothing but handing over. The log line is written on the reply thread, also for a
    // command whose client has left.
    const auto shared = std::make_shared<const Result<Command>>(std::move(result));
    call->complete(
        [to, shared, also]() -> grpc::Status {
          if (!*shared) return to_status(shared->error());
          to_proto(**shared, *to);
          if (also) also();
          return grpc::Status::OK;
        },
        [client, subject, what, shared, called] { log(client, subject, what, *shared, called); });
  };
}

}  // namespace axisd::server
