#include "api/server/command_reply.hpp"

#include <spdlog/spdlog.h>

#include <utility>

#include "api/server/convert.hpp"
#include "api/server/status.hpp"

namespace axisd::server {
namespace {

/// Three times in each hold, for as long as somebody jogs.
bool is_renewal(const Command& command, const std::optional<WallTime>& called) {
  const bool renewable = command.kind == CommandKind::jog || command.kind == CommandKind::move_velocity;
  return called && renewable && !ended(command.state) && command.accepted_at < *called;
}

void log(std::string_view client, std::string_view subject, std::string_view what,
         const Result<Command>& result, const std::optional<WallTime>& called) {
  if (!result) {
    spdlog::info("{}: {} {} refused: {}", client, subject, what, to_string(result.error()));
  } else if (result->cause) {
    spdlog::info("{}: {} {} {} ({}): {}", client, subject, what, to_string(result->state), result->id,
                 to_string(*result->cause));
  } else {
    spdlog::log(is_renewal(*result, called) ? spdlog::level::debug : spdlog::level::info, "{}: {} {} {} ({})",
                client, subject, what, to_string(result->state), result->id);
  }
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
