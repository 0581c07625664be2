#pragma once

#include "api/server/bounded_service.hpp"
#include "api/server/services.hpp"
#include "api/server/validate.hpp"
#include "axisd/v1/axis_service.grpc.pb.h"

namespace axisd::server {

/// AxisService: validates, converts, asks the machine. WatchAxes answers in raw bytes, so that serialised
/// batches are shared between streams. Thread: gRPC.
class AxisServiceImpl final
    : public BoundedService<
          v1::AxisService::WithRawCallbackMethod_WatchAxes<v1::AxisService::CallbackService>> {
 public:
  explicit AxisServiceImpl(const Services& services);

  using Context = grpc::CallbackServerContext;
  using Reactor = grpc::ServerUnaryReactor;
  Reactor* ListAxes(Context* context, const v1::ListAxesRequest* request,
                    v1::ListAxesResponse* response) override;
  Reactor* GetAxis(Context* context, const v1::GetAxisRequest* request,
                   v1::GetAxisResponse* response) override;
  grpc::ServerWriteReactor<grpc::ByteBuffer>* WatchAxes(Context* context,
                                                        const grpc::ByteBuffer* request) override;
  Reactor* Enable(Context* context, const v1::EnableRequest* request, v1::EnableResponse* response) override;
  Reactor* Disable(Context* context, const v1::DisableRequest* request,
                   v1::DisableResponse* response) override;
  Reactor* Home(Context* context, const v1::HomeRequest* request, v1::HomeResponse* response) override;
  Reactor* MoveAbsolute(Context* context, const v1::MoveAbsoluteRequest* request,
                        v1::MoveAbsoluteResponse* response) override;
  Reactor* MoveRelative(Context* context, const v1::MoveRelativeRequest* request,
                        v1::MoveRelativeResponse* response) override;
  Reactor* MoveVelocity(Context* context, const v1::MoveVelocityRequest* request,
                        v1::MoveVelocityResponse* response) override;
  Reactor* Jog(Context* context, const v1::JogRequest* request, v1::JogResponse* response) override;
  Reactor* Halt(Context* context, const v1::HaltRequest* request, v1::HaltResponse* response) override;
  Reactor* Stop(Context* context, const v1::StopRequest* request, v1::StopResponse* response) override;
  Reactor* QuickStop(Context* context, const v1::QuickStopRequest* request,
                     v1::QuickStopResponse* response) override;
  Reactor* ReleaseStop(Context* context, const v1::ReleaseStopRequest* request,
                       v1::ReleaseStopResponse* response) override;
  Reactor* Reset(Context* context, const v1::ResetRequest* request, v1::ResetResponse* response) override;
  Reactor* SetPosition(Context* context, const v1::SetPositionRequest* request,
                       v1::SetPositionResponse* response) override;

 private:
  /// Submits a command that the limits per client apply to.
  template <class Request>
  Reactor* move(Context* context, const Request& request, v1::Command* command);
  /// Submits a stop: on its own lane, never limited, never refused for its options.
  template <class Request, class Response>
  Reactor* stop(Context* context, const Request& request, Response* response);
  Reactor* submit(Context* context, const std::string& axis, Action action, Submission submission,
                  Admission::Ticket ticket, v1::Command* command);

  const Services services_;
};

}  // namespace axisd::server
