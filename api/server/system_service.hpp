#pragma once

#include "api/server/bounded_service.hpp"
#include "api/server/services.hpp"
#include "axisd/v1/system_service.grpc.pb.h"

namespace axisd::server {

/// SystemService: the machine as a whole. Thread: gRPC.
class SystemServiceImpl final : public BoundedService<v1::SystemService::CallbackService> {
 public:
  explicit SystemServiceImpl(const Services& services);

  using Context = grpc::CallbackServerContext;
  grpc::ServerUnaryReactor* GetInfo(Context* context, const v1::GetInfoRequest* request,
                                    v1::GetInfoResponse* response) override;
  grpc::ServerUnaryReactor* StopAll(Context* context, const v1::StopAllRequest* request,
                                    v1::StopAllResponse* response) override;
  grpc::ServerUnaryReactor* ReleaseStopAll(Context* context, const v1::ReleaseStopAllRequest* request,
                                           v1::ReleaseStopAllResponse* response) override;
  grpc::ServerUnaryReactor* GetState(Context* context, const v1::GetStateRequest* request,
                                     v1::GetStateResponse* response) override;
  grpc::ServerUnaryReactor* AcceptState(Context* context, const v1::AcceptStateRequest* request,
                                        v1::AcceptStateResponse* response) override;
  grpc::ServerUnaryReactor* BackUpState(Context* context, const v1::BackUpStateRequest* request,
                                        v1::BackUpStateResponse* response) override;
  grpc::ServerUnaryReactor* Explain(Context* context, const v1::ExplainRequest* request,
                                    v1::ExplainResponse* response) override;
  grpc::ServerUnaryReactor* GetConfig(Context* context, const v1::GetConfigRequest* request,
                                      v1::GetConfigResponse* response) override;
  grpc::ServerUnaryReactor* CheckConfig(Context* context, const v1::CheckConfigRequest* request,
                                        v1::CheckConfigResponse* response) override;
  grpc::ServerUnaryReactor* ReloadConfig(Context* context, const v1::ReloadConfigRequest* request,
                                         v1::ReloadConfigResponse* response) override;
  grpc::ServerUnaryReactor* SetLogLevel(Context* context, const v1::SetLogLevelRequest* request,
                                        v1::SetLogLevelResponse* response) override;

 private:
  const Services services_;
};

}  // namespace axisd::server
