#pragma once

#include "api/server/bounded_service.hpp"
#include "api/server/services.hpp"
#include "axisd/v1/group_service.grpc.pb.h"

namespace axisd::server {

/// GroupService: validates, converts, asks the machine. Stops are never limited, nor refused for anything in
/// them that is not known. Thread: gRPC.
class GroupServiceImpl final : public BoundedService<v1::GroupService::CallbackService> {
 public:
  explicit GroupServiceImpl(const Services& services);

  using Context = grpc::CallbackServerContext;
  using Reactor = grpc::ServerUnaryReactor;
  Reactor* ListGroups(Context* context, const v1::ListGroupsRequest* request,
                      v1::ListGroupsResponse* response) override;
  Reactor* MoveGroup(Context* context, const v1::MoveGroupRequest* request,
                     v1::MoveGroupResponse* response) override;
  Reactor* PrepareMove(Context* context, const v1::PrepareMoveRequest* request,
                       v1::PrepareMoveResponse* response) override;
  Reactor* StartPrepared(Context* context, const v1::StartPreparedRequest* request,
                         v1::StartPreparedResponse* response) override;
  Reactor* RenewPrepared(Context* context, const v1::RenewPreparedRequest* request,
                         v1::RenewPreparedResponse* response) override;
  Reactor* GetGroupMove(Context* context, const v1::GetGroupMoveRequest* request,
                        v1::GetGroupMoveResponse* response) override;
  Reactor* GroupHalt(Context* context, const v1::GroupHaltRequest* request,
                     v1::GroupHaltResponse* response) override;
  Reactor* GroupStop(Context* context, const v1::GroupStopRequest* request,
                     v1::GroupStopResponse* response) override;
  Reactor* GroupReleaseStop(Context* context, const v1::GroupReleaseStopRequest* request,
                            v1::GroupReleaseStopResponse* response) override;

 private:
  template <class Response>
  Reactor* move(Context* context, Result<GroupMoveRequest> wanted, const v1::CommandOptions& options,
                const Caller& caller, std::string what, Response* response);

  const Services services_;
};

}  // namespace axisd::server
