#include "api/server/drive_service.hpp"

#include <fmt/format.h>

#include <memory>
#include <utility>

#include "api/server/drive_convert.hpp"
#include "api/server/drive_validate.hpp"
#include "api/server/pending_call.hpp"
#include "api/server/progress_stream.hpp"
#include "api/server/status.hpp"
#include "api/server/validate.hpp"
#include "api/server/value_reply.hpp"
#include "buses/limited_log.hpp"

namespace axisd::server {
namespace {

using Call = std::shared_ptr<PendingCall>;
using Values = std::vector<ParameterValue>;

/// How a change is logged, by whom and of what.
std::string entry(std::string_view client, std::string_view axis, std::string_view what) {
  return fmt::format("{}: {} {}", client, axis, what);
}

/// Who asks for a change, and under which lease.
template <class Request>
Requester requester(Caller caller, const Request& request) {
  return {.client = std::move(caller.name),
          .lease_token = request.lease_token(),
          .origin = std::move(caller.origin)};
}

}  // namespace

DriveServiceImpl::DriveServiceImpl(const Services& services) : BoundedService(services), services_(services) {
  begin_within_bounds(&DriveServiceImpl::GetDrive, &DriveServiceImpl::ListParameters,
                      &DriveServiceImpl::ReadParameters, &DriveServiceImpl::WriteParameters,
                      &DriveServiceImpl::SaveParameters, &DriveServiceImpl::RestoreFactory,
                      &DriveServiceImpl::ReadSegments, &DriveServiceImpl::WriteSegments,
                      &DriveServiceImpl::Readdress, &DriveServiceImpl::SetSerial);
}

DriveServiceImpl::Reactor* DriveServiceImpl::refuse(Context* context, std::string_view what,
                                                    const Error& error) {
  log_limited(spdlog::level::info, client_of(*context), "refused calls",
              fmt::format("{} refused: {}", what, to_string(error)));
  return answer(context, to_status(error));
}

DriveServiceImpl::Reactor* DriveServiceImpl::begin(Context* context, Admission::Kind kind,
                                                   const std::function<void(const Call&)>& ask) {
  auto ticket = services_.admission.admit(client_of(*context), kind);
  if (!ticket) return answer(context, to_status(ticket.error()));
  return PendingCall::start(services_, context, *std::move(ticket), ask);
}

DriveServiceImpl::Reactor* DriveServiceImpl::GetDrive(Context* context, const v1::GetDriveRequest* request,
                                                      v1::GetDriveResponse* response) {
  const auto& axis = request->axis();
  if (auto known = find_axis(services_.machine, axis); !known)
    return answer(context, to_status(known.error()));
  return begin(context, Admission::Kind::read, [&](const Call& call) {
    services_.machine.drive_access().drive_info(
        axis, reply_with_value<DriveInfo>(
                  call, [axis, response](const DriveInfo& info) { to_proto(axis, info, *response); }));
  });
}

DriveServiceImpl::Reactor* DriveServiceImpl::ListParameters(Context* context,
                                                            const v1::ListParametersRequest* request,
                                                            v1::ListParametersResponse* response) {
  if (auto known = find_axis(services_.machine, request->axis()); !known)
    return answer(context, to_status(known.error()));
  return begin(context, Admission::Kind::read, [&](const Call& call) {
    services_.machine.drive_access().drive_info(
        request->axis(),
        reply_with_value<DriveInfo>(call, [response](const DriveInfo& info) { to_proto(info, *response); }));
  });
}

DriveServiceImpl::Reactor* DriveServiceImpl::ReadParameters(Context* context,
                                                            const v1::ReadParametersRequest* request,
                                                            v1::ReadParametersResponse* response) {
  const auto drive = find_drive(services_.machine, request->axis());
  if (!drive) return answer(context, to_status(drive.error()));
  const auto addresses = parameters_to_read(*request, *drive);
  if (!addresses) return answer(context, to_status(addresses.error()));
  return begin(context, Admission::Kind::read, [&](const Call& call) {
    services_.machine.drive_access().read_parameters(
        request->axis(), *addresses,
        reply_with_value<Values>(call, [response, model = drive->model](const Values& values) {
          to_proto(values, *model, *response->mutable_values());
        }));
  });
}

DriveServiceImpl::Reactor* DriveServiceImpl::WriteParameters(Context* context,
                                                             const v1::WriteParametersRequest* request,
                                                             v1::WriteParametersResponse* response) {
  const auto drive = find_drive(services_.machine, request->axis());
  if (!drive) return refuse(context, "write_parameters", drive.error());
  const auto values = parameters_to_write(*request, *drive);
  if (!values) return refuse(context, "write_parameters", values.error());
  return begin(context, Admission::Kind::motion, [&](const Call& call) {
    std::string what = entry(client_of(*context), request->axis(), "write_parameters");
    for (const auto& value : request->values()) what += fmt::format(" {}={}", value.name(), value.value());
    services_.machine.drive_access().write_parameters(
        request->axis(), *values, requester(who_asks(*context, *request), *request),
        reply_with_value<Values>(
            call,
            [response, model = drive->model](const Values& read_back) {
              to_proto(read_back, *model, *response->mutable_values());
            },
            std::move(what)));
  });
}

DriveServiceImpl::Reactor* DriveServiceImpl::SaveParameters(Context* context,
                                                            const v1::SaveParametersRequest* request,
                                                            v1::SaveParametersResponse*) {
  const auto& axis = request->axis();
  if (auto known = find_axis(services_.machine, axis); !known)
    return refuse(context, "save_parameters", known.error());
  if (auto confirmed = check_confirmed(axis, request->confirm()); !confirmed)
    return refuse(context, "save_parameters", confirmed.error());
  return begin(context, Admission::Kind::motion, [&](const Call& call) {
    services_.machine.drive_access().save_parameters(
        axis, requester(who_asks(*context, *request), *request),
        reply_with_value<void>(call, [] {}, entry(client_of(*context), axis, "save_parameters")));
  });
}

DriveServiceImpl::Reactor* DriveServiceImpl::RestoreFactory(Context* context,
                                                            const v1::RestoreFactoryRequest* request,
                                                            v1::RestoreFactoryResponse* response) {
  const auto& axis = request->axis();
  if (auto known = find_axis(services_.machine, axis); !known)
    return refuse(context, "restore_factory", known.error());
  if (auto confirmed = check_confirmed(axis, request->confirm()); !confirmed)
    return refuse(context, "restore_factory", confirmed.error());
  return begin(context, Admission::Kind::motion, [&](const Call& call) {
    services_.machine.drive_access().restore_factory(
        axis, requester(who_asks(*context, *request), *request),
        reply_with_value<std::string>(
            call, [response](const std::string& text) { response->set_after_power_cycle(text); },
            entry(client_of(*context), axis, "restore_factory")));
  });
}

DriveServiceImpl::Reactor* DriveServiceImpl::ReadSegments(Context* context,
                                                          const v1::ReadSegmentsRequest* request,
                                                          v1::ReadSegmentsResponse* response) {
  if (auto known = find_axis(services_.machine, request->axis()); !known)
    return answer(context, to_status(known.error()));
  return begin(context, Admission::Kind::read, [&](const Call& call) {
    services_.machine.drive_access().read_segments(
        request->axis(), reply_with_value<SegmentSettings>(call, [response](const SegmentSettings& segments) {
          to_proto(segments, *response->mutable_segments());
        }));
  });
}

DriveServiceImpl::Reactor* DriveServiceImpl::WriteSegments(Context* context,
                                                           const v1::WriteSegmentsRequest* request,
                                                           v1::WriteSegmentsResponse* response) {
  const auto drive = find_drive(services_.machine, request->axis());
  if (!drive) return refuse(context, "write_segments", drive.error());
  // An empty table clears the drive's: that must be meant.
  if (!request->has_segments())
    return refuse(context, "write_segments",
                  {.reason = Reason::invalid_argument,
                   .message = "segments is missing",
                   .remedy = "set it; an empty table clears the drive's"});
  const auto segments = segments_to_write(request->segments(), *drive);
  if (!segments) return refuse(context, "write_segments", segments.error());
  return begin(context, Admission::Kind::motion, [&](const Call& call) {
    services_.machine.drive_access().write_segments(
        request->axis(), *segments, requester(who_asks(*context, *request), *request),
        reply_with_value<SegmentSettings>(
            call,
            [response](const SegmentSettings& read_back) {
              to_proto(read_back, *response->mutable_segments());
            },
            entry(client_of(*context), request->axis(), "write_segments")));
  });
}

template <class Response, class Request>
grpc::ServerWriteReactor<Response>* DriveServiceImpl::change_serial(Context* context,
                                                                    const Request& request) {
  const auto client = client_of(*context);
  const auto& what = Request::descriptor()->name();
  const auto refused = [&](const Error& error) {
    log_limited(spdlog::level::info, client, "refused calls",
                fmt::format("{} {} refused: {}", request.axis(), what, to_string(error)));
    return new RefusedStream<Response>(to_status(error));
  };
  const auto drive = find_drive(services_.machine, request.axis());
  if (!drive) return refused(drive.error());
  const auto change = serial_change(request, *drive);
  if (!change) return refused(change.error());
  auto ticket = services_.admission.admit(client, Admission::Kind::stream);
  if (!ticket) return refused(ticket.error());
  log_limited(spdlog::level::info, client, "calls", fmt::format("{} {} accepted", request.axis(), what));
  using Stream = ProgressStream<Response, SerialProgress>;
  const auto last =
      change->verify > Duration::zero() ? SerialProgress::Phase::verified : SerialProgress::Phase::written;
  auto* stream = Stream::start(
      services_, context, *std::move(ticket),
      [&](typename Stream::Callback callback) {
        return services_.machine.drive_access().change_serial(
            request.axis(), *change, requester(who_asks(*context, request), request), std::move(callback));
      },
      [last](const SerialProgress& from, Response& to) {
        to.set_phase(to_proto(from.phase));
        to.set_text(from.text);
        return from.phase == last;
      });
  return stream != nullptr ? stream : new RefusedStream<Response>(shutting_down());
}

grpc::ServerWriteReactor<v1::ReaddressResponse>* DriveServiceImpl::Readdress(
    Context* context, const v1::ReaddressRequest* request) {
  return change_serial<v1::ReaddressResponse>(context, *request);
}

grpc::ServerWriteReactor<v1::SetSerialResponse>* DriveServiceImpl::SetSerial(
    Context* context, const v1::SetSerialRequest* request) {
  return change_serial<v1::SetSerialResponse>(context, *request);
}

}  // namespace axisd::server
