#include "api/server/command_reply.hpp"

#include <spdlog/spdlog.h>

#include <utility>

#include "api/server/convert.hpp"
#include "api/server/status.hpp"

namespace axisd::server {
namespace {

void log(std::string_view client, std::string_view subject, std::string_view what,
         const Result<Command>& result) {
  if (!result) {
    spdlog::info("{}: {} {} refused: {}", client, subject, what, to_string(result.error()));
  } else if (result->cause) {
    spdlog::info("{}: {} {} {} ({}): {}", client, subject, what, to_string(result->state), result->id,
                 to_string(*result->cause));
  } else {
    spdlog::info("{}: {} {} {} ({})", client, subject, what, to_string(result->state), result->id);
  }
}

}  // namespace

Machine::CommandCallback reply_with_command(std::shared_ptr<PendingCall> call, v1::Command* to,
                                            std::string client, std::string subject, std::string_view what,
                                            std::function<void()> also) {
  return [call = std::move(call), to, client = std::move(client), subject = std::move(subject), what,
          also = std::move(also)](Result<Command> result) {
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
        [client, subject, what, shared] { log(client, subject, what, *shared); });
  };
}

}  // namespace axisd::server
