#include "api/server/axis_service.hpp"

#include <fmt/format.h>
#include <grpcpp/support/proto_buffer_reader.h>
#include <spdlog/spdlog.h>

#include <utility>

#include "api/server/command_reply.hpp"
#include "api/server/convert.hpp"
#include "api/server/hold_validate.hpp"
#include "api/server/pending_call.hpp"
#include "api/server/reply_stream.hpp"
#include "api/server/status.hpp"
#include "api/server/stop_requests.hpp"
#include "api/server/value_reply.hpp"
#include "api/server/watch_hub.hpp"
#include "api/transport/patience.hpp"
#include "buses/limited_log.hpp"

namespace axisd::server {
namespace {

grpc::ServerUnaryReactor* refuse(grpc::CallbackServerContext* context, const std::string& client,
                                 std::string_view what, const Error& error) {
  log_limited(spdlog::level::info, client, "refused calls",
              fmt::format("{} refused: {}", what, to_string(error)));
  return answer(context, to_status(error));
}

}  // namespace

AxisServiceImpl::AxisServiceImpl(const Services& services) : BoundedService(services), services_(services) {
  begin_within_bounds(&AxisServiceImpl::ListAxes, &AxisServiceImpl::GetAxis, &AxisServiceImpl::Enable,
                      &AxisServiceImpl::Disable, &AxisServiceImpl::Home, &AxisServiceImpl::MoveAbsolute,
                      &AxisServiceImpl::MoveRelative, &AxisServiceImpl::MoveVelocity, &AxisServiceImpl::Jog,
                      &AxisServiceImpl::Halt, &AxisServiceImpl::Stop, &AxisServiceImpl::QuickStop,
                      &AxisServiceImpl::ReleaseStop, &AxisServiceImpl::Reset, &AxisServiceImpl::SetPosition);
}

template <class Request>
AxisServiceImpl::Reactor* AxisServiceImpl::move(Context* context, const Request& request,
                                                v1::Command* command) {
  const auto caller = who_asks(*context, request);
  const auto& client = caller.name;
  const auto& what = Request::descriptor()->name();
  if (auto axis = find_axis(services_.machine, request.axis()); !axis)
    return refuse(context, client, what, axis.error());
  auto action = to_action(request);
  if (!action) return refuse(context, client, what, action.error());
  auto submission = motion_options(request.options(), client, services_.machine);
  if (!submission) return refuse(context, client, what, submission.error());
  submission->options.origin = caller.origin;
  if (const auto patience = transport::patience_of(*context))
    submission->options.call_deadline = services_.machine.now() + *patience;
  auto ticket = services_.admission.admit(client, Admission::Kind::motion);
  if (!ticket) return refuse(context, client, what, ticket.error());
  return submit(context, request.axis(), *std::move(action), *std::move(submission), *std::move(ticket),
                command);
}

template <class Request, class Response>
AxisServiceImpl::Reactor* AxisServiceImpl::stop(Context* context, const Request& request,
                                                Response* response) {
  return PendingCall::start(services_, context, {}, [&](const std::shared_ptr<PendingCall>& call) {
    handle(services_.machine, request, who_asks(*context, request), call, response);
  });
}

AxisServiceImpl::Reactor* AxisServiceImpl::submit(Context* context, const std::string& axis, Action action,
                                                  Submission submission, Admission::Ticket ticket,
                                                  v1::Command* command) {
  const auto what = to_string(kind_of(action));
  return PendingCall::start(
      services_, context, std::move(ticket), [&](const std::shared_ptr<PendingCall>& call) {
        auto client = submission.options.client;
        services_.machine.submit(axis, std::move(action), std::move(submission.options), submission.until,
                                 reply_with_command(call, command, std::move(client), axis, what, {},
                                                    services_.machine.wall(services_.machine.now())));
      });
}

AxisServiceImpl::Reactor* AxisServiceImpl::ListAxes(Context* context, const v1::ListAxesRequest*,
                                                    v1::ListAxesResponse* response) {
  const auto now = services_.machine.now();
  for (const auto& name : services_.machine.axis_names())
    if (const auto snapshot = services_.machine.snapshot(name))
      to_proto(*snapshot, now, *response->add_axes());
  return answer(context, grpc::Status::OK);
}

AxisServiceImpl::Reactor* AxisServiceImpl::GetAxis(Context* context, const v1::GetAxisRequest* request,
                                                   v1::GetAxisResponse* response) {
  const auto snapshot = find_axis(services_.machine, request->axis());
  if (!snapshot) return answer(context, to_status(snapshot.error()));
  to_proto(**snapshot, services_.machine.now(), *response->mutable_state());
  return answer(context, grpc::Status::OK);
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* AxisServiceImpl::WatchAxes(Context* context,
                                                                       const grpc::ByteBuffer* request) {
  v1::WatchAxesRequest parsed;
  auto bytes = *request;
  if (!grpc::SerializationTraits<v1::WatchAxesRequest>::Deserialize(&bytes, &parsed).ok())
    return new RefusedStream<grpc::ByteBuffer>(to_status({.reason = Reason::invalid_argument,
                                                          .message = "the request is not a WatchAxesRequest",
                                                          .remedy = "use the published proto files"}));
  if (const auto may = admit(*context, parsed); !may)
    return new RefusedStream<grpc::ByteBuffer>(to_status(may.error()));
  auto axes = watched_axes(parsed, services_.machine);
  if (!axes) return new RefusedStream<grpc::ByteBuffer>(to_status(axes.error()));
  const auto period = watch_period(parsed);
  if (!period) return new RefusedStream<grpc::ByteBuffer>(to_status(period.error()));
  auto fields = watched_fields(parsed);
  if (!fields) return new RefusedStream<grpc::ByteBuffer>(to_status(fields.error()));
  const auto client = client_of(*context);
  auto ticket = services_.admission.admit(client, Admission::Kind::stream);
  if (!ticket) return new RefusedStream<grpc::ByteBuffer>(to_status(ticket.error()));
  spdlog::debug("{}: watches {}", client, axes->empty() ? "all axes" : fmt::format("{} axes", axes->size()));
  auto* stream =
      services_.hub.open(services_, context, *std::move(ticket),
                         {.axes = *std::move(axes), .period = *period, .fields = *std::move(fields)});
  return stream != nullptr ? stream : new RefusedStream<grpc::ByteBuffer>(shutting_down());
}

AxisServiceImpl::Reactor* AxisServiceImpl::Enable(Context* context, const v1::EnableRequest* request,
                                                  v1::EnableResponse* response) {
  return move(context, *request, response->mutable_command());
}
AxisServiceImpl::Reactor* AxisServiceImpl::Disable(Context* context, const v1::DisableRequest* request,
                                                   v1::DisableResponse* response) {
  return stop(context, *request, response);
}
AxisServiceImpl::Reactor* AxisServiceImpl::Home(Context* context, const v1::HomeRequest* request,
                                                v1::HomeResponse* response) {
  return move(context, *request, response->mutable_command());
}
AxisServiceImpl::Reactor* AxisServiceImpl::MoveAbsolute(Context* context,
                                                        const v1::MoveAbsoluteRequest* request,
                                                        v1::MoveAbsoluteResponse* response) {
  return move(context, *request, response->mutable_command());
}
AxisServiceImpl::Reactor* AxisServiceImpl::MoveRelative(Context* context,
                                                        const v1::MoveRelativeRequest* request,
                                                        v1::MoveRelativeResponse* response) {
  return move(context, *request, response->mutable_command());
}
AxisServiceImpl::Reactor* AxisServiceImpl::MoveVelocity(Context* context,
                                                        const v1::MoveVelocityRequest* request,
                                                        v1::MoveVelocityResponse* response) {
  return move(context, *request, response->mutable_command());
}
AxisServiceImpl::Reactor* AxisServiceImpl::Jog(Context* context, const v1::JogRequest* request,
                                               v1::JogResponse* response) {
  return move(context, *request, response->mutable_command());
}
AxisServiceImpl::Reactor* AxisServiceImpl::Halt(Context* context, const v1::HaltRequest* request,
                                                v1::HaltResponse* response) {
  return stop(context, *request, response);
}
AxisServiceImpl::Reactor* AxisServiceImpl::Stop(Context* context, const v1::StopRequest* request,
                                                v1::StopResponse* response) {
  return stop(context, *request, response);
}
AxisServiceImpl::Reactor* AxisServiceImpl::QuickStop(Context* context, const v1::QuickStopRequest* request,
                                                     v1::QuickStopResponse* response) {
  return stop(context, *request, response);
}
AxisServiceImpl::Reactor* AxisServiceImpl::ReleaseStop(Context* context,
                                                       const v1::ReleaseStopRequest* request,
                                                       v1::ReleaseStopResponse* response) {
  const auto client = client_of(*context);
  if (auto axis = find_axis(services_.machine, request->axis()); !axis)
    return refuse(context, client, "release_stop", axis.error());
  auto release = release_of(*request, client);
  if (!release) return refuse(context, client, "release_stop", release.error());
  return PendingCall::start(services_, context, {}, [&](const std::shared_ptr<PendingCall>& call) {
    services_.machine.release_stop(request->axis(), *std::move(release),
                                   reply_with_value<StopReleased>(
                                       call,
                                       [response](const StopReleased& released) {
                                         if (released.stop)
                                           to_proto(*released.stop, *response->mutable_command());
                                         to_proto(released.holds, *response->mutable_holds());
                                       },
                                       fmt::format("{}: {} release_stop", client, request->axis())));
  });
}
AxisServiceImpl::Reactor* AxisServiceImpl::Reset(Context* context, const v1::ResetRequest* request,
                                                 v1::ResetResponse* response) {
  return move(context, *request, response->mutable_command());
}
AxisServiceImpl::Reactor* AxisServiceImpl::SetPosition(Context* context,
                                                       const v1::SetPositionRequest* request,
                                                       v1::SetPositionResponse* response) {
  return move(context, *request, response->mutable_command());
}

}  // namespace axisd::server
