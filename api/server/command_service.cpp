#include "api/server/command_service.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <memory>
#include <utility>
#include <vector>

#include "api/server/command_stream.hpp"
#include "api/server/convert.hpp"
#include "api/server/pending_call.hpp"
#include "api/server/status.hpp"
#include "api/server/stop_requests.hpp"
#include "api/server/validate.hpp"

namespace axisd::server {

namespace {

constexpr std::size_t usual_commands = 20, most_commands = 500;

}  // namespace

CommandServiceImpl::CommandServiceImpl(const Services& services)
    : BoundedService(services), services_(services) {
  begin_within_bounds(&CommandServiceImpl::ListCommands, &CommandServiceImpl::GetCommand,
                      &CommandServiceImpl::WatchCommand, &CommandServiceImpl::CancelCommand);
}

grpc::ServerUnaryReactor* CommandServiceImpl::ListCommands(Context* context,
                                                           const v1::ListCommandsRequest* request,
                                                           v1::ListCommandsResponse* response) {
  if (!request->axis().empty())
    if (const auto axis = find_axis(services_.machine, request->axis()); !axis)
      return answer(context, to_status(axis.error()));
  if (request->limit() > most_commands)
    return answer(context, to_status({.reason = Reason::out_of_range,
                                      .message = fmt::format("limit is {}", request->limit()),
                                      .remedy = "ask for fewer; WatchEvents tells of each command",
                                      .permitted = Range{.minimum = 0, .maximum = most_commands}}));
  auto ticket = services_.admission.admit(client_of(*context), Admission::Kind::read);
  if (!ticket) return answer(context, to_status(ticket.error()));
  return PendingCall::start(
      services_, context, *std::move(ticket), [&](const std::shared_ptr<PendingCall>& call) {
        services_.machine.list_commands(
            request->axis(), request->limit() == 0 ? usual_commands : request->limit(),
            [call, response](std::vector<Command> commands) {
              call->complete([response, commands = std::move(commands)]() -> grpc::Status {
                for (const auto& command : commands) to_proto(command, *response->add_commands());
                return grpc::Status::OK;
              });
            });
      });
}

grpc::ServerUnaryReactor* CommandServiceImpl::GetCommand(Context* context,
                                                         const v1::GetCommandRequest* request,
                                                         v1::GetCommandResponse* response) {
  if (const auto valid = check_command_id(request->id()); !valid)
    return answer(context, to_status(valid.error()));
  auto ticket = services_.admission.admit(client_of(*context), Admission::Kind::read);
  if (!ticket) return answer(context, to_status(ticket.error()));
  auto* command = response->mutable_command();
  return PendingCall::start(
      services_, context, *std::move(ticket), [&](const std::shared_ptr<PendingCall>& call) {
        services_.machine.get_command(request->id(), [call, command](Result<Command> result) {
          call->complete([command, result = std::move(result)]() -> grpc::Status {
            if (!result) return to_status(result.error());
            to_proto(*result, *command);
            return grpc::Status::OK;
          });
        });
      });
}

grpc::ServerWriteReactor<v1::WatchCommandResponse>* CommandServiceImpl::WatchCommand(
    Context* context, const v1::WatchCommandRequest* request) {
  if (const auto valid = check_command_id(request->id()); !valid)
    return new RefusedStream<v1::WatchCommandResponse>(to_status(valid.error()));
  const auto client = client_of(*context);
  auto ticket = services_.admission.admit(client, Admission::Kind::stream);
  if (!ticket) return new RefusedStream<v1::WatchCommandResponse>(to_status(ticket.error()));
  spdlog::debug("{}: watches command {}", client, request->id());
  auto* stream = CommandStream::start(services_, context, request->id(), *std::move(ticket));
  return stream != nullptr ? stream : new RefusedStream<v1::WatchCommandResponse>(shutting_down());
}

grpc::ServerUnaryReactor* CommandServiceImpl::CancelCommand(Context* context,
                                                            const v1::CancelCommandRequest* request,
                                                            v1::CancelCommandResponse* response) {
  return PendingCall::start(services_, context, {}, [&](const std::shared_ptr<PendingCall>& call) {
    handle(services_.machine, *request, who_asks(*context, *request), call, response);
  });
}

}  // namespace axisd::server
