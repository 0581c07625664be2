#include "api/server/group_service.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "api/server/convert.hpp"
#include "api/server/group_convert.hpp"
#include "api/server/hold_validate.hpp"
#include "api/server/pending_call.hpp"
#include "api/server/status.hpp"
#include "api/server/stop_requests.hpp"
#include "api/server/validate.hpp"
#include "api/server/value_reply.hpp"
#include "api/transport/patience.hpp"
#include "buses/limited_log.hpp"

namespace axisd::server {

namespace {

/// With the machine's clock, where the response has a place for it.
template <class Response>
void fill(Response& response, const GroupMove& move, [[maybe_unused]] const Machine& machine) {
  to_proto(move, *response.mutable_move());
  if constexpr (requires { response.mutable_clock(); }) to_proto(machine.now(), *response.mutable_clock());
}

template <class Response>
auto told(const Machine& machine, Response* response) {
  return [&machine, response](const GroupMove& move) { fill(*response, move, machine); };
}

}  // namespace

GroupServiceImpl::GroupServiceImpl(const Services& services) : BoundedService(services), services_(services) {
  begin_within_bounds(
      &GroupServiceImpl::ListGroups, &GroupServiceImpl::MoveGroup, &GroupServiceImpl::PrepareMove,
      &GroupServiceImpl::StartPrepared, &GroupServiceImpl::RenewPrepared, &GroupServiceImpl::GetGroupMove,
      &GroupServiceImpl::GroupHalt, &GroupServiceImpl::GroupStop, &GroupServiceImpl::GroupReleaseStop);
}

GroupServiceImpl::Reactor* GroupServiceImpl::ListGroups(Context* context, const v1::ListGroupsRequest*,
                                                        v1::ListGroupsResponse* response) {
  for (const auto& group : services_.machine.group_access().groups())
    to_proto(group, *response->add_groups());
  return answer(context, grpc::Status::OK);
}

template <class Response>
GroupServiceImpl::Reactor* GroupServiceImpl::move(Context* context, Result<GroupMoveRequest> wanted,
                                                  const v1::CommandOptions& options, const Caller& caller,
                                                  std::string what, Response* response) {
  const auto& client = caller.name;
  if (!wanted) return answer(context, to_status(wanted.error()));
  auto submission = motion_options(options, client, services_.machine);
  if (!submission) return answer(context, to_status(submission.error()));
  submission->options.origin = caller.origin;
  if (const auto patience = transport::patience_of(*context))
    submission->options.call_deadline = services_.machine.now() + *patience;
  auto ticket = services_.admission.admit(client, Admission::Kind::motion);
  if (!ticket) return answer(context, to_status(ticket.error()));
  return PendingCall::start(
      services_, context, *std::move(ticket), [&](const std::shared_ptr<PendingCall>& call) {
        what = fmt::format("{}: {} {}", client, what, wanted->group);
        services_.machine.group_access().move(
            *std::move(wanted), std::move(submission->options), submission->until,
            reply_with_value<GroupMove>(call, told(services_.machine, response), std::move(what)));
      });
}

GroupServiceImpl::Reactor* GroupServiceImpl::MoveGroup(Context* context, const v1::MoveGroupRequest* request,
                                                       v1::MoveGroupResponse* response) {
  return move(context, to_request(*request), request->options(), who_asks(*context, *request), "move_group",
              response);
}

GroupServiceImpl::Reactor* GroupServiceImpl::PrepareMove(Context* context,
                                                         const v1::PrepareMoveRequest* request,
                                                         v1::PrepareMoveResponse* response) {
  return move(context, to_request(*request), request->move().options(), who_asks(*context, *request),
              "prepare_move", response);
}

GroupServiceImpl::Reactor* GroupServiceImpl::StartPrepared(Context* context,
                                                           const v1::StartPreparedRequest* request,
                                                           v1::StartPreparedResponse* response) {
  const auto client = client_of(*context);
  auto wanted = to_request(*request, client);
  if (!wanted) return answer(context, to_status(wanted.error()));
  const auto until = wait_until(request->wait_until());
  if (!until) return answer(context, to_status(until.error()));
  auto ticket = services_.admission.admit(client, Admission::Kind::motion);
  if (!ticket) return answer(context, to_status(ticket.error()));
  return PendingCall::start(
      services_, context, *std::move(ticket), [&](const std::shared_ptr<PendingCall>& call) {
        auto what = fmt::format("{}: start_prepared {}", client, wanted->id);
        services_.machine.group_access().start(
            *std::move(wanted), *until,
            reply_with_value<GroupMove>(call, told(services_.machine, response), std::move(what)));
      });
}

GroupServiceImpl::Reactor* GroupServiceImpl::RenewPrepared(Context* context,
                                                           const v1::RenewPreparedRequest* request,
                                                           v1::RenewPreparedResponse* response) {
  return PendingCall::start(services_, context, {}, [&](const std::shared_ptr<PendingCall>& call) {
    handle(services_.machine, *request, who_asks(*context, *request), call, response);
  });
}

GroupServiceImpl::Reactor* GroupServiceImpl::GetGroupMove(Context* context,
                                                          const v1::GetGroupMoveRequest* request,
                                                          v1::GetGroupMoveResponse* response) {
  if (auto valid = check_command_id(request->id()); !valid) return answer(context, to_status(valid.error()));
  auto ticket = services_.admission.admit(client_of(*context), Admission::Kind::read);
  if (!ticket) return answer(context, to_status(ticket.error()));
  return PendingCall::start(
      services_, context, *std::move(ticket), [&](const std::shared_ptr<PendingCall>& call) {
        services_.machine.group_access().get(
            request->id(), reply_with_value<GroupMove>(call, [response](const GroupMove& move) {
              to_proto(move, *response->mutable_move());
            }));
      });
}

GroupServiceImpl::Reactor* GroupServiceImpl::GroupHalt(Context* context, const v1::GroupHaltRequest* request,
                                                       v1::GroupHaltResponse* response) {
  return PendingCall::start(services_, context, {}, [&](const std::shared_ptr<PendingCall>& call) {
    handle(services_.machine, *request, who_asks(*context, *request), call, response);
  });
}

GroupServiceImpl::Reactor* GroupServiceImpl::GroupStop(Context* context, const v1::GroupStopRequest* request,
                                                       v1::GroupStopResponse* response) {
  return PendingCall::start(services_, context, {}, [&](const std::shared_ptr<PendingCall>& call) {
    handle(services_.machine, *request, who_asks(*context, *request), call, response);
  });
}

GroupServiceImpl::Reactor* GroupServiceImpl::GroupReleaseStop(Context* context,
                                                              const v1::GroupReleaseStopRequest* request,
                                                              v1::GroupReleaseStopResponse* response) {
  const auto client = client_of(*context);
  auto release = release_of(*request, client);
  if (!release) return answer(context, to_status(release.error()));
  GroupReleaseRequest wanted{.group = request->group(),
                             .axes = {request->axes().begin(), request->axes().end()},
                             .release = *std::move(release)};
  return PendingCall::start(services_, context, {}, [&](const std::shared_ptr<PendingCall>& call) {
    services_.machine.group_access().release_stop(
        std::move(wanted), [call, response, client](std::vector<GroupReleaseResult> results) {
          const auto shared = std::make_shared<const std::vector<GroupReleaseResult>>(std::move(results));
          call->complete(
              [response, shared]() -> grpc::Status {
                for (const auto& result : *shared) to_proto(result, *response->add_results());
                if (shared->empty()) return to_status(nothing_named());
                const bool nothing = std::ranges::all_of(*shared, [](const GroupReleaseResult& result) {
                  return !result.holds && result.holds.error().reason == Reason::unknown_axis;
                });
                return nothing ? to_status(shared->front().holds.error()) : grpc::Status::OK;
              },
              [client, shared] {
                log_limited(spdlog::level::info, client, "calls",
                            fmt::format("group release_stop of {} axes", shared->size()));
              });
        });
  });
}

}  // namespace axisd::server
