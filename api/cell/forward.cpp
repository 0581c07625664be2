#include "api/cell/forward.hpp"

#include <fmt/format.h>
#include <grpcpp/client_context.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/support/client_callback.h>
#include <grpcpp/support/server_callback.h>

#include <expected>
#include <mutex>
#include <utility>

#include "api/cell/names.hpp"
#include "api/cell/status.hpp"
#include "config/text.hpp"

namespace axisd::cell {
namespace {

using axisd::v1::REASON_ACCESS_DENIED;
using axisd::v1::REASON_BUSY;
using axisd::v1::REASON_INVALID_ARGUMENT;
using axisd::v1::REASON_NOT_SUPPORTED;
using axisd::v1::REASON_OFFLINE;
using axisd::v1::REASON_UNAUTHENTICATED;
using grpc::StatusCode;

/// Where a call goes, and what it is given on its way.
struct Passage {
  std::shared_ptr<grpc::Channel> channel;
  std::shared_ptr<RouteTally> tally;
  Metadata metadata;
  std::string caller;
  OpenCalls::Kind kind;
};
using Judged = std::expected<Passage, grpc::Status>;

std::unexpected<grpc::Status> refuse(StatusCode code, axisd::v1::Reason reason, std::string message,
                                     std::string remedy) {
  return std::unexpected(to_status(code, reason, std::move(message), std::move(remedy)));
}

/// Whom for. A stop is never refused for whose it is: it goes on as the entrance's own.
std::expected<Metadata, grpc::Status> whose(const grpc::ServerContextBase& context, const Caller& caller,
                                            bool stops) {
  const bool claims = metadata_of(context, user_key) || metadata_of(context, role_key);
  if (claims && !stops)
    return refuse(StatusCode::PERMISSION_DENIED, REASON_ACCESS_DENIED,
                  fmt::format("{} may not speak for others at the entrance of a cell", caller.name),
                  fmt::format("leave out the metadata {} and {}", user_key, role_key));
  auto metadata = Callers::metadata_for(caller);
  if (!metadata && !stops)
    return refuse(
        StatusCode::PERMISSION_DENIED, REASON_ACCESS_DENIED,
        fmt::format("{} is a name that axisd does not take from a delegate", config::quoted(caller.name)),
        "use a certificate with a name of at most 64 characters without spaces");
  return metadata.value_or(Metadata());
}

std::expected<const Route*, grpc::Status> route_to(const Routes& routes, const std::string& own,
                                                   std::optional<std::string_view> asked) {
  const auto name = asked.value_or(own);
  // A name that cannot be one is not repeated: it may be anything.
  const auto found = is_machine_name(name) ? routes.machines.find(name) : routes.machines.end();
  if (found == routes.machines.end())
    return refuse(StatusCode::NOT_FOUND, REASON_INVALID_ARGUMENT,
                  fmt::format("no machine {} is known in this cell", config::quoted(name)),
                  "CellService.ListMachines tells which there are");
  if (found->second.open) return &found->second;
  found->second.tally->refused.fetch_add(1, std::memory_order_relaxed);
  return refuse(StatusCode::UNAVAILABLE, REASON_OFFLINE, fmt::format("{}: {}", name, found->second.why),
                "check its power, its network, and that axisd runs there; nothing was sent");
}

Judged judge(const grpc::GenericCallbackServerContext& context, const RouteTable& table,
             const Caller& caller) {
  if (caller.refusal)
    return refuse(StatusCode::UNAUTHENTICATED, REASON_UNAUTHENTICATED, caller.refusal->message,
                  caller.refusal->remedy);
  const auto& path = context.method();
  const auto asked = metadata_of(context, machine_key);
  if (metadata_of(context, hops_key))
    return refuse(
        StatusCode::FAILED_PRECONDITION, REASON_INVALID_ARGUMENT,
        fmt::format("a loop: another entrance has passed this call on to the entrance of {}, in place of an "
                    "axisd",
                    table.own()),
        fmt::format("the address of the axisd of {} leads to an entrance: correct axisd.advertise, or peers",
                    asked && is_machine_name(*asked) ? *asked : table.own()));
  auto metadata = whose(context, caller, is_stop(path));
  if (!metadata) return std::unexpected(metadata.error());
  const auto routes = table.now();
  const auto route = route_to(*routes, table.own(), asked);
  if (!route) return std::unexpected(route.error());
  const auto& way = (*route)->way;
  const bool to_lane = is_for_lane(path);
  if (to_lane && !way.lane_is_ready())
    return refuse(StatusCode::UNIMPLEMENTED, REASON_NOT_SUPPORTED,
                  "the stop lane of that machine cannot be reached from here",
                  "ask for the same at its main address");
  metadata->emplace_back(hops_key, "1");
  metadata->emplace_back(machine_key, asked.value_or(table.own()));
  return Passage{.channel = to_lane ? way.lane : way.main,
                 .tally = (*route)->tally,
                 .metadata = *std::move(metadata),
                 .caller = caller.name,
                 .kind = is_never_counted(path) ? OpenCalls::Kind::stop : OpenCalls::Kind::counted};
}

/// What belongs to the connection, and not to the call.
bool is_of_transport(std::string_view key) {
  return key.starts_with(":") || key.starts_with("grpc-") || key == "content-type" || key == "user-agent" ||
         key == "te" || key == "accept-encoding";
}

/// One call on both its sides. The caller's side is this reactor, the machine's an inner one. Goes when both
/// are done.
///
///   caller: read -> machine: write -> caller: read ... -> until the caller has no more: writes done
///   machine: read -> caller: write -> machine: read ... -> until the machine has no more: its status
///
/// The machine's side begins with the first message, so that both leave together; and it has two holds, as
/// what it does is asked for from outside of its own reactions: one until its last read has failed, one until
/// nothing is written to it any more.
class Forwarded final : public grpc::ServerGenericBidiReactor {
 public:
  Forwarded(grpc::GenericCallbackServerContext& context, Passage passage, RouteTable& table, OpenCalls& calls)
      : context_(context),
        passage_(std::move(passage)),
        table_(table),
        calls_(calls),
        arrived_(monotonic_now()),
        machine_(*this) {
    passage_.tally->open.fetch_add(1, std::memory_order_relaxed);
    StartRead(&request_);
  }

 private:
  class Machine final : public grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
   public:
    explicit Machine(Forwarded& call) : call_(call) {}
    void OnReadInitialMetadataDone(bool ok) override { call_.on_head(ok); }
    void OnReadDone(bool ok) override { call_.on_answer(ok); }
    void OnWriteDone(bool ok) override { call_.on_passed(ok); }
    void OnDone(const grpc::Status& status) override { call_.on_end(status); }

   private:
    Forwarded& call_;
  };
  /// Of the machine's side.
  enum class Side : std::uint8_t {
    before,  ///< the call has not begun there
    idle,    ///< nothing is being written
    writing,
    last,    ///< the same, and nothing more comes after it
    closed,  ///< nothing is written any more; its hold is gone
    over,    ///< it has ended
  };

  // The caller's side.
  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;
  // The machine's side.
  void begin();
  void on_head(bool ok);
  void on_answer(bool ok);
  void on_passed(bool ok);
  void on_end(const grpc::Status& status);
  /// Under mutex_.
  void close_writing();
  void leave();

  grpc::GenericCallbackServerContext& context_;
  const Passage passage_;
  RouteTable& table_;
  OpenCalls& calls_;
  const TimePoint arrived_;
  Machine machine_;
  std::unique_ptr<grpc::GenericStub> stub_;
  grpc::ClientContext away_;
  grpc::ByteBuffer request_, response_;
  int answers_ = 0;

  std::mutex mutex_;
  Side side_ = Side::before;  ///< under mutex_, as the rest
  bool cancelled_ = false;    ///< by the caller
  int parts_ = 2;             ///< sides that are not done
};

void Forwarded::begin() {
  stub_ = std::make_unique<grpc::GenericStub>(passage_.channel);
  for (const auto& [key, value] : context_.client_metadata()) {
    const std::string_view name(key.data(), key.size());
    if (is_of_transport(name) || name == machine_key || name == hops_key || name == user_key ||
        name == role_key)
      continue;
    away_.AddMetadata(std::string(name), std::string(value.data(), value.size()));
  }
  for (const auto& [key, value] : passage_.metadata) away_.AddMetadata(key, value);
  const auto deadline = context_.deadline();
  if (deadline != std::chrono::system_clock::time_point::max()) away_.set_deadline(deadline);
  away_.set_initial_metadata_corked(true);
  stub_->PrepareBidiStreamingCall(&away_, context_.method(), {}, &machine_);
  machine_.AddMultipleHolds(2);
}

void Forwarded::OnReadDone(bool ok) {
  if (ok) passage_.tally->bytes_in.fetch_add(request_.Length(), std::memory_order_relaxed);
  std::unique_lock lock(mutex_);
  // A caller who has gone has not ended its request: the machine is not told that it is whole.
  if (!ok && context_.IsCancelled()) cancelled_ = true;
  if (side_ == Side::before && cancelled_) {  // nothing has left here, and nothing will
    side_ = Side::over;
    --parts_;
    lock.unlock();
    return Finish(grpc::Status::CANCELLED);
  }
  if (side_ == Side::before) {
    begin();
    side_ = ok ? Side::writing : Side::idle;
    if (ok) machine_.StartWrite(&request_);
    if (!ok) close_writing();
    return machine_.StartCall();
  }
  if (side_ != Side::idle) return;  // it has ended there: whatever comes is for nobody
  if (!ok) return close_writing();
  side_ = Side::writing;
  machine_.StartWrite(&request_);
}

void Forwarded::close_writing() {
  side_ = Side::closed;
  if (cancelled_)
    away_.TryCancel();
  else
    machine_.StartWritesDone();
  machine_.RemoveHold();
}

void Forwarded::on_passed(bool ok) {
  const std::lock_guard lock(mutex_);
  if (!ok || side_ == Side::last) {
    side_ = Side::closed;
    machine_.RemoveHold();
    return;
  }
  side_ = Side::idle;
  StartRead(&request_);
}

void Forwarded::on_head(bool ok) {
  if (!ok) return machine_.StartRead(&response_);
  for (const auto& [key, value] : away_.GetServerInitialMetadata()) {
    const std::string_view name(key.data(), key.size());
    if (!is_of_transport(name))
      context_.AddInitialMetadata(std::string(name), std::string(value.data(), value.size()));
  }
  // It leaves with the first answer: a head of its own would cost a message more. Until it is here, no answer
  // is read, which would overtake it.
  machine_.StartRead(&response_);
}

void Forwarded::on_answer(bool ok) {
  if (ok) {
    ++answers_;
    passage_.tally->bytes_out.fetch_add(response_.Length(), std::memory_order_relaxed);
    StartWrite(&response_);
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    // It has no more to say, so nothing is said to it any more, whatever the caller may still send.
    if (side_ == Side::writing) side_ = Side::last;
    if (side_ == Side::idle) {
      side_ = Side::closed;
      machine_.RemoveHold();
    }
  }
  machine_.RemoveHold();
}

void Forwarded::OnWriteDone(bool ok) {
  if (!ok) away_.TryCancel();  // the caller is gone; the rest is read until it fails
  machine_.StartRead(&response_);
}

void Forwarded::OnCancel() {
  const std::lock_guard lock(mutex_);
  cancelled_ = true;
  if (side_ != Side::before && side_ != Side::over) away_.TryCancel();
}

void Forwarded::on_end(const grpc::Status& status) {
  auto& tally = status.ok() ? passage_.tally->good : passage_.tally->failed;
  tally.fetch_add(1, std::memory_order_relaxed);
  if (answers_ <= 1) table_.note(monotonic_now() - arrived_);
  for (const auto& [key, value] : away_.GetServerTrailingMetadata()) {
    const std::string_view name(key.data(), key.size());
    if (!is_of_transport(name))
      context_.AddTrailingMetadata(std::string(name), std::string(value.data(), value.size()));
  }
  {
    const std::lock_guard lock(mutex_);
    side_ = Side::over;
  }
  Finish(status);
  leave();
}

void Forwarded::OnDone() { leave(); }

void Forwarded::leave() {
  {
    const std::lock_guard lock(mutex_);
    if (--parts_ > 0) return;
  }
  passage_.tally->open.fetch_sub(1, std::memory_order_relaxed);
  calls_.leave(passage_.caller, passage_.kind);
  delete this;
}

/// A call that is not passed on.
class Refused final : public grpc::ServerGenericBidiReactor {
 public:
  explicit Refused(const grpc::Status& status) { Finish(status); }

 private:
  void OnDone() override { delete this; }
};

}  // namespace

grpc::ServerGenericBidiReactor* Forwarder::CreateReactor(grpc::GenericCallbackServerContext* context) {
  auto judged = judge(*context, routes_, callers_.of(*context));
  if (!judged) {
    routes_.refused.fetch_add(1, std::memory_order_relaxed);
    return new Refused(judged.error());
  }
  if (!calls_.enter(judged->caller, judged->kind)) {
    routes_.too_many.fetch_add(1, std::memory_order_relaxed);
    return new Refused(to_status(StatusCode::RESOURCE_EXHAUSTED, REASON_BUSY,
                                 fmt::format("{} has too many calls open at this entrance", judged->caller),
                                 "end some of them; stops are not counted among them"));
  }
  return new Forwarded(*context, *std::move(judged), routes_, calls_);
}

}  // namespace axisd::cell
