#include "api/server/pending_call.hpp"

#include <grpcpp/server_context.h>

#include <utility>

#include "api/server/status.hpp"

namespace axisd::server {

PendingCall::PendingCall(const Services& services, Admission::Ticket ticket)
    : reply_(services.reply), calls_(services.calls), ticket_(std::move(ticket)) {}

grpc::ServerUnaryReactor* PendingCall::start(const Services& services, grpc::CallbackServerContext* context,
                                             Admission::Ticket ticket, const Ask& ask) {
  const auto call = std::make_shared<PendingCall>(services, std::move(ticket));
  if (!services.calls->add(call, context->peer())) return answer(context, shutting_down());
  call->self_ = call;
  ask(call);
  return call.get();
}

void PendingCall::complete(Fill fill, Job always) {
  reply_->post([call = shared_from_this(), fill = std::move(fill), always = std::move(always)]() mutable {
    if (always) always();
    if (!call->finished_) call->finish(fill());
  });
}

void PendingCall::close(const grpc::Status& status) {
  reply_->post([call = shared_from_this(), status] { call->finish(status); });
}

void PendingCall::OnCancel() { close({grpc::StatusCode::CANCELLED, "the call ended before its answer"}); }

void PendingCall::OnDone() {
  calls_->remove(this);
  const auto last = std::move(self_);  // may end this object, after this function
}

void PendingCall::finish(const grpc::Status& status) {
  if (std::exchange(finished_, true)) return;
  ticket_.release();
  calls_->answered(this);
  Finish(status);
}

grpc::ServerUnaryReactor* answer(grpc::CallbackServerContext* context, const grpc::Status& status) {
  auto* reactor = context->DefaultReactor();
  reactor->Finish(status);
  return reactor;
}

}  // namespace axisd::server
