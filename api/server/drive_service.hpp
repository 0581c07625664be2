#pragma once

#include <functional>
#include <memory>
#include <string_view>

#include "api/server/bounded_service.hpp"
#include "api/server/pending_call.hpp"
#include "api/server/services.hpp"
#include "axisd/v1/drive_service.grpc.pb.h"

namespace axisd::server {

/// DriveService: validates, converts, asks the machine's DriveAccess. Thread: gRPC.
class DriveServiceImpl final : public BoundedService<v1::DriveService::CallbackService> {
 public:
  explicit DriveServiceImpl(const Services& services);

  using Context = grpc::CallbackServerContext;
  using Reactor = grpc::ServerUnaryReactor;
  Reactor* GetDrive(Context* context, const v1::GetDriveRequest* request,
                    v1::GetDriveResponse* response) override;
  Reactor* ListParameters(Context* context, const v1::ListParametersRequest* request,
                          v1::ListParametersResponse* response) override;
  Reactor* ReadParameters(Context* context, const v1::ReadParametersRequest* request,
                          v1::ReadParametersResponse* response) override;
  Reactor* WriteParameters(Context* context, const v1::WriteParametersRequest* request,
                           v1::WriteParametersResponse* response) override;
  Reactor* SaveParameters(Context* context, const v1::SaveParametersRequest* request,
                          v1::SaveParametersResponse* response) override;
  Reactor* RestoreFactory(Context* context, const v1::RestoreFactoryRequest* request,
                          v1::RestoreFactoryResponse* response) override;
  Reactor* ReadSegments(Context* context, const v1::ReadSegmentsRequest* request,
                        v1::ReadSegmentsResponse* response) override;
  Reactor* WriteSegments(Context* context, const v1::WriteSegmentsRequest* request,
                         v1::WriteSegmentsResponse* response) override;
  grpc::ServerWriteReactor<v1::ReaddressResponse>* Readdress(Context* context,
                                                             const v1::ReaddressRequest* request) override;
  grpc::ServerWriteReactor<v1::SetSerialResponse>* SetSerial(Context* context,
                                                             const v1::SetSerialRequest* request) override;

 private:
  /// Counts the call and asks; `ask` must arrange for the call to be completed.
  Reactor* begin(Context* context, Admission::Kind kind,
                 const std::function<void(const std::shared_ptr<PendingCall>&)>& ask);
  Reactor* refuse(Context* context, std::string_view what, const Error& error);
  template <class Response, class Request>
  grpc::ServerWriteReactor<Response>* change_serial(Context* context, const Request& request);

  const Services services_;
};

}  // namespace axisd::server
