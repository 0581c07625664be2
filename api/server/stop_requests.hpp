// Every kind of stop, and what keeps a motion or a lease alive: from a request to its answer, whoever carries
// them. Nothing is counted here (admission.hpp), and nothing in a request but names makes a stop fail.
#pragma once

#include "api/server/access.hpp"
#include "api/server/reply.hpp"
#include "axisd/v1/axis_service.pb.h"
#include "axisd/v1/command_service.pb.h"
#include "axisd/v1/group_service.pb.h"
#include "axisd/v1/lease_service.pb.h"
#include "axisd/v1/system_service.pb.h"
#include "devices/machine.hpp"

namespace axisd::server {

// `machine` outlives the answer; `response` exists as long as `reply` asks for it to be filled.
void handle(Machine& machine, const v1::HaltRequest& request, const Caller& caller, const ReplyPtr& reply,
            v1::HaltResponse* response);
void handle(Machine& machine, const v1::StopRequest& request, const Caller& caller, const ReplyPtr& reply,
            v1::StopResponse* response);
void handle(Machine& machine, const v1::QuickStopRequest& request, const Caller& caller,
            const ReplyPtr& reply, v1::QuickStopResponse* response);
void handle(Machine& machine, const v1::DisableRequest& request, const Caller& caller, const ReplyPtr& reply,
            v1::DisableResponse* response);
void handle(Machine& machine, const v1::GroupHaltRequest& request, const Caller& caller,
            const ReplyPtr& reply, v1::GroupHaltResponse* response);
void handle(Machine& machine, const v1::GroupStopRequest& request, const Caller& caller,
            const ReplyPtr& reply, v1::GroupStopResponse* response);
void handle(Machine& machine, const v1::StopAllRequest& request, const Caller& caller, const ReplyPtr& reply,
            v1::StopAllResponse* response);
void handle(Machine& machine, const v1::RenewLeaseRequest& request, const Caller& caller,
            const ReplyPtr& reply, v1::RenewLeaseResponse* response);
void handle(Machine& machine, const v1::RenewPreparedRequest& request, const Caller& caller,
            const ReplyPtr& reply, v1::RenewPreparedResponse* response);
void handle(Machine& machine, const v1::CancelCommandRequest& request, const Caller& caller,
            const ReplyPtr& reply, v1::CancelCommandResponse* response);

}  // namespace axisd::server
