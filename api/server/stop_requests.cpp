#include "api/server/stop_requests.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "api/server/command_reply.hpp"
#include "api/server/convert.hpp"
#include "api/server/group_convert.hpp"
#include "api/server/hold_validate.hpp"
#include "api/server/status.hpp"
#include "api/server/validate.hpp"
#include "api/server/value_reply.hpp"
#include "buses/limited_log.hpp"

namespace axisd::server {
namespace {

void refuse(const ReplyPtr& reply, const std::string& client, std::string_view what, const Error& error) {
  reply->complete([error] { return to_status(error); },
                  [client, what = std::string(what), error] {
                    log_limited(spdlog::level::info, client, "refused calls",
                                fmt::format("{} refused: {}", what, to_string(error)),
                                LogKind::command_refused, {.client = client});
                  });
}

template <class Request, class Response>
void stop_axis(Machine& machine, const Request& request, const Caller& caller, const ReplyPtr& reply,
               Response* response) {
  const auto& name = Request::descriptor()->name();
  const auto& client = caller.name;
  if (auto axis = find_axis(machine, request.axis()); !axis) return refuse(reply, client, name, axis.error());
  auto action = to_action(request);
  if (!action) return refuse(reply, client, name, action.error());
  std::function<void()> also;
  if constexpr (requires { response->mutable_holds(); })
    if (request.hold())
      also = [&machine, axis = request.axis(), response] {
        if (const auto now = machine.snapshot(axis)) to_proto(now->holds, *response->mutable_holds());
      };
  auto submission = stop_options(request.options(), client);
  submission.options.origin = caller.origin;
  const auto what = to_string(kind_of(*action));
  machine.submit(request.axis(), *std::move(action), std::move(submission.options), submission.until,
                 reply_with_command(reply, response->mutable_command(), client, request.axis(), what,
                                    std::move(also), machine.wall(machine.now())));
}

template <class Request, class Response>
void stop_group(Machine& machine, const Request& request, StopKind kind, const Caller& caller,
                const ReplyPtr& reply, Response* response) {
  const auto& client = caller.name;
  GroupStopRequest wanted{.group = request.group(),
                          .axes = {request.axes().begin(), request.axes().end()},
                          .kind = kind,
                          .origin = caller.origin};
  if constexpr (requires { request.hold(); }) {
    wanted.hold = request.hold();
    wanted.request_id = hold_id(request.request_id());
  }
  const bool hold = wanted.hold;
  machine.group_access().stop(
      std::move(wanted), client, stop_all_wait(request.wait_until()),
      [reply, response, client, kind, hold, &machine](std::vector<GroupStopResult> results) {
        const auto shared = std::make_shared<const std::vector<GroupStopResult>>(std::move(results));
        reply->complete(
            [response, shared, hold, &machine]() -> grpc::Status {
              for (const auto& result : *shared) {
                auto& entry = *response->add_results();
                to_proto(result, entry);
                const auto now = hold ? machine.snapshot(result.axis) : nullptr;
                if (now) to_proto(now->holds, *entry.mutable_holds());
              }
              if (shared->empty()) return to_status(nothing_named());
              const bool nothing = std::ranges::all_of(*shared, [](const GroupStopResult& result) {
                return !result.command && result.command.error().reason == Reason::unknown_axis;
              });
              return nothing ? to_status(shared->front().command.error()) : grpc::Status::OK;
            },
            [client, kind, shared] {
              if (shared->empty()) return;  // the daemon asks this of itself, again and again
              log_limited(spdlog::level::info, client, "stops",
                          fmt::format("group {} of {} axes", kind == StopKind::halt ? "halt" : "stop",
                                      shared->size()),
                          LogKind::stop_called, {.client = client});
            });
      });
}

using Results = std::vector<Result<Command>>;

void to_proto(const Results& results, const std::vector<std::string>& axes, v1::StopAllResponse& to) {
  for (std::size_t i = 0; i < results.size(); ++i) {
    auto& entry = *to.add_results();
    if (i < axes.size()) entry.set_axis(axes[i]);  // the machine answers in its axes' order
    if (results[i]) {
      entry.set_axis(results[i]->axis);
      server::to_proto(*results[i], *entry.mutable_command());
    } else {
      server::to_proto(results[i].error(), *entry.mutable_error());
    }
  }
}

}  // namespace

void handle(Machine& machine, const v1::HaltRequest& request, const Caller& caller, const ReplyPtr& reply,
            v1::HaltResponse* response) {
  stop_axis(machine, request, caller, reply, response);
}
void handle(Machine& machine, const v1::StopRequest& request, const Caller& caller, const ReplyPtr& reply,
            v1::StopResponse* response) {
  stop_axis(machine, request, caller, reply, response);
}
void handle(Machine& machine, const v1::QuickStopRequest& request, const Caller& caller,
            const ReplyPtr& reply, v1::QuickStopResponse* response) {
  stop_axis(machine, request, caller, reply, response);
}
void handle(Machine& machine, const v1::DisableRequest& request, const Caller& caller, const ReplyPtr& reply,
            v1::DisableResponse* response) {
  stop_axis(machine, request, caller, reply, response);
}
void handle(Machine& machine, const v1::GroupHaltRequest& request, const Caller& caller,
            const ReplyPtr& reply, v1::GroupHaltResponse* response) {
  stop_group(machine, request, StopKind::halt, caller, reply, response);
}
void handle(Machine& machine, const v1::GroupStopRequest& request, const Caller& caller,
            const ReplyPtr& reply, v1::GroupStopResponse* response) {
  stop_group(machine, request, StopKind::stop, caller, reply, response);
}

void handle(Machine& machine, const v1::StopAllRequest& request, const Caller& caller, const ReplyPtr& reply,
            v1::StopAllResponse* response) {
  auto axes = machine.axis_names();
  const auto& client = caller.name;
  machine.stop_all({.client = client, .origin = caller.origin}, stop_all_wait(request.wait_until()),
                   [reply, response, client, axes = std::move(axes)](AllStopped stopped) {
                     const auto shared = std::make_shared<const AllStopped>(std::move(stopped));
                     reply->complete(
                         [response, axes, shared] {
                           to_proto(shared->stops, axes, *response);
                           if (shared->not_durable)
                             to_proto(*shared->not_durable, *response->mutable_not_durable());
                           return grpc::Status::OK;
                         },
                         [client, shared] {
                           log_limited(
                               spdlog::level::info, client, "stops",
                               fmt::format("stop_all of {} axes, inhibit latched{}", shared->stops.size(),
                                           shared->not_durable ? ", not durable" : ""),
                               LogKind::stop_all, {.client = client});
                         });
                   });
}

void handle(Machine& machine, const v1::RenewLeaseRequest& request, const Caller& caller,
            const ReplyPtr& reply, v1::RenewLeaseResponse* response) {
  machine.lease_access().renew({.client = caller.name, .lease_token = request.lease_token()},
                               reply_with_value<Lease>(reply, [response, &machine](const Lease& lease) {
                                 to_proto(lease, machine, *response->mutable_lease());
                               }));
}

void handle(Machine& machine, const v1::RenewPreparedRequest& request, const Caller& caller,
            const ReplyPtr& reply, v1::RenewPreparedResponse* response) {
  if (const auto valid = check_command_id(request.id()); !valid)
    return refuse(reply, caller.name, "renew", valid.error());
  machine.group_access().renew(
      request.id(), caller.name, request.all_told() ? GroupRenewal::all_told : GroupRenewal::waits,
      reply_with_value<GroupMove>(reply, [response, &machine](const GroupMove& move) {
        // Asked for several times a second, beside stops: members are many.
        if (ended(move.state))
          to_proto(move, *response->mutable_move());
        else
          to_proto_without_members(move, *response->mutable_move());
        to_proto(machine.now(), *response->mutable_clock());
      }));
}

void handle(Machine& machine, const v1::CancelCommandRequest& request, const Caller& caller,
            const ReplyPtr& reply, v1::CancelCommandResponse* response) {
  if (const auto valid = check_command_id(request.id()); !valid)
    return refuse(reply, caller.name, "cancel", valid.error());
  machine.cancel_command(
      request.id(), caller.name,
      reply_with_command(reply, response->mutable_command(), caller.name, request.id(), "cancel"));
}

}  // namespace axisd::server
