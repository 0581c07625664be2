#include "api/server/lane/stop_calls.hpp"

#include <algorithm>
#include <chrono>
#include <memory>
#include <ranges>
#include <utility>

#include "api/server/bounds.hpp"
#include "api/server/command_reply.hpp"
#include "api/server/status.hpp"
#include "api/server/stop_requests.hpp"
#include "api/server/validate.hpp"
#include "devices/nearest.hpp"

namespace axisd::server::lane {
namespace {

struct Context {
  Machine& machine;
  Admission& admission;
  Allowance& suggestions;
  const Http2::Call& call;
  const AccessSettings* access;
  const Peer& peer;
  Refusals& refusals;
  Caller caller;  ///< whom the call is for
  StopCalls::Done done;
};

Answer answer_of(const grpc::Status& status, const google::protobuf::Message& response) {
  if (status.ok()) return {.code = 0, .error = {}, .details = {}, .message = response.SerializeAsString()};
  return {.code = status.error_code(),
          .error = status.error_message(),
          .details = status.error_details(),
          .message = {}};
}

/// A call that waits for the machine. Its response lives as long as anybody may fill it.
template <class Response>
class LaneReply final : public Reply {
 public:
  LaneReply(StopCalls::Done done, Admission::Ticket ticket)
      : done_(std::move(done)), ticket_(std::move(ticket)) {}

  void complete(Fill fill, Job always) override {
    done_([response = response_, fill = std::move(fill), always = std::move(always)]() mutable {
      if (always) always();
      const auto status = fill();
      return answer_of(status, *response);
    });
  }
  [[nodiscard]] Response* response() const { return response_.get(); }

 private:
  StopCalls::Done done_;
  Admission::Ticket ticket_;
  std::shared_ptr<Response> response_ = std::make_shared<Response>();
};

void refuse(const StopCalls::Done& done, const Error& error) {
  done([error] { return answer_of(to_status(error), v1::StopResponse::default_instance()); });
}

template <class Request>
std::optional<Request> parsed(Context& context) {
  Request request;
  if (!request.ParseFromString(context.call.message)) {
    refuse(context.done, {.reason = Reason::invalid_argument,
                          .message = "the request is no " + Request::descriptor()->name(),
                          .remedy = "use the published proto files"});
    return std::nullopt;
  }
  if (const auto within = check_bounds(request); !within) {
    refuse(context.done, within.error());
    return std::nullopt;
  }
  const auto groups =
      context.access == nullptr ? std::vector<GroupSettings>() : context.machine.group_access().groups();
  context.caller.origin = origin_of(context.access, context.peer, context.caller, request, groups);
  if (const auto may = admitted(context.access, context.peer, context.call.claim, request, groups); !may) {
    context.refusals.tell(context.caller, request, may.error());
    refuse(context.done, may.error());
    return std::nullopt;
  }
  return request;
}

/// False: there is no such axis, which is all that is said.
bool known_or_suggested(const Context& context, const std::string& axis) {
  if (context.machine.snapshot(axis) || context.suggestions.take(context.machine.now())) return true;
  refuse(context.done, no_such_axis(axis, {}));
  return false;
}

template <class Request, class Response>
void take(Context context) {
  const auto request = parsed<Request>(context);
  if (!request) return;
  if constexpr (requires { request->axis(); })
    if (!known_or_suggested(context, request->axis())) return;
  const auto reply = std::make_shared<LaneReply<Response>>(std::move(context.done), Admission::Ticket());
  handle(context.machine, *request, context.caller, reply, reply->response());
}

/// A jog and what renews it come by one way, in the order in which they were sent; so does the halt after it.
void jog(Context context) {
  const auto request = parsed<v1::JogRequest>(context);
  if (!request || !known_or_suggested(context, request->axis())) return;
  if (auto axis = find_axis(context.machine, request->axis()); !axis)
    return refuse(context.done, axis.error());
  auto action = to_action(*request);
  if (!action) return refuse(context.done, action.error());
  const auto& client = context.caller.name;
  auto submission = motion_options(request->options(), client, context.machine);
  if (!submission) return refuse(context.done, submission.error());
  submission->options.origin = context.caller.origin;
  if (context.call.patience)
    submission->options.call_deadline = context.machine.now() + *context.call.patience;
  auto ticket = context.admission.admit(client, Admission::Kind::motion);
  if (!ticket) return refuse(context.done, ticket.error());
  const auto reply =
      std::make_shared<LaneReply<v1::JogResponse>>(std::move(context.done), *std::move(ticket));
  context.machine.submit(
      request->axis(), *std::move(action), std::move(submission->options), submission->until,
      reply_with_command(reply, reply->response()->mutable_command(), client, request->axis(),
                         to_string(CommandKind::jog), {}, context.machine.wall(context.machine.now())));
}

struct Entry {
  std::string_view path;
  void (*handler)(Context context);
};

constexpr Entry table[] = {
    {"/axisd.v1.StopService/Halt", &take<v1::HaltRequest, v1::HaltResponse>},
    {"/axisd.v1.StopService/Stop", &take<v1::StopRequest, v1::StopResponse>},
    {"/axisd.v1.StopService/QuickStop", &take<v1::QuickStopRequest, v1::QuickStopResponse>},
    {"/axisd.v1.StopService/Disable", &take<v1::DisableRequest, v1::DisableResponse>},
    {"/axisd.v1.StopService/Jog", &jog},
    {"/axisd.v1.StopService/GroupHalt", &take<v1::GroupHaltRequest, v1::GroupHaltResponse>},
    {"/axisd.v1.StopService/GroupStop", &take<v1::GroupStopRequest, v1::GroupStopResponse>},
    {"/axisd.v1.StopService/StopAll", &take<v1::StopAllRequest, v1::StopAllResponse>},
    {"/axisd.v1.StopService/RenewLease", &take<v1::RenewLeaseRequest, v1::RenewLeaseResponse>},
    {"/axisd.v1.StopService/RenewPrepared", &take<v1::RenewPreparedRequest, v1::RenewPreparedResponse>},
    {"/axisd.v1.StopService/CancelCommand", &take<v1::CancelCommandRequest, v1::CancelCommandResponse>},
};

}  // namespace

bool Allowance::take(TimePoint now) {
  const auto passed = std::chrono::duration<double>(now - refilled_).count();
  left_ = std::min(rate_, left_ + std::max(0.0, passed) * rate_);
  refilled_ = now;
  if (left_ < 1) return false;
  --left_;
  return true;
}

StopCalls::StopCalls(Machine& machine, std::shared_ptr<const AccessControl> access, AuditSink* audit)
    : machine_(machine),
      access_(access ? std::move(access) : std::make_shared<const AccessControl>()),
      refusals_(machine, audit),
      admission_({}) {}

void StopCalls::start(const Http2::Call& call, const Peer& peer, Done done) {
  const auto* found = std::ranges::find(table, call.path, &Entry::path);
  if (found == std::end(table))
    return refuse(done, {.reason = Reason::not_supported,
                         .message = "this port takes stops, and what renews a jog or a lease",
                         .remedy = "ask for everything else at the main port"});
  const auto access = access_->settings();
  found->handler({.machine = machine_,
                  .admission = admission_,
                  .suggestions = suggestions_,
                  .call = call,
                  .access = access.get(),
                  .peer = peer,
                  .refusals = refusals_,
                  .caller = admitted_caller(access.get(), peer, call.claim),
                  .done = std::move(done)});
}

std::vector<std::string_view> StopCalls::paths() {
  std::vector<std::string_view> paths;
  paths.reserve(std::size(table));
  for (const auto& entry : table) paths.push_back(entry.path);
  return paths;
}

}  // namespace axisd::server::lane
