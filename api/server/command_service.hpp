#pragma once

#include "api/server/bounded_service.hpp"
#include "api/server/services.hpp"
#include "axisd/v1/command_service.grpc.pb.h"

namespace axisd::server {

/// CommandService: validates, converts, asks the machine. Thread: gRPC.
class CommandServiceImpl final : public BoundedService<v1::CommandService::CallbackService> {
 public:
  explicit CommandServiceImpl(const Services& services);

  using Context = grpc::CallbackServerContext;
  grpc::ServerUnaryReactor* ListCommands(Context* context, const v1::ListCommandsRequest* request,
                                         v1::ListCommandsResponse* response) override;
  grpc::ServerUnaryReactor* GetCommand(Context* context, const v1::GetCommandRequest* request,
                                       v1::GetCommandResponse* response) override;
  grpc::ServerWriteReactor<v1::WatchCommandResponse>* WatchCommand(
      Context* context, const v1::WatchCommandRequest* request) override;
  grpc::ServerUnaryReactor* CancelCommand(Context* context, const v1::CancelCommandRequest* request,
                                          v1::CancelCommandResponse* response) override;

 private:
  const Services services_;
};

}  // namespace axisd::server
