#include "api/server/trace_stream.hpp"

#include <utility>

#include "api/server/bus_watch_convert.hpp"
#include "api/server/status.hpp"

namespace axisd::server {

TraceStream::TraceStream(const Services& services, grpc::CallbackServerContext* context,
                         Admission::Ticket ticket, std::string bus)
    : ReplyStream(services, context, std::move(ticket)), bus_(std::move(bus)) {}

grpc::ServerWriteReactor<v1::TraceBusResponse>* TraceStream::start(const Services& services,
                                                                   grpc::CallbackServerContext* context,
                                                                   Admission::Ticket ticket,
                                                                   TraceRequest request) {
  const auto stream = std::make_shared<TraceStream>(services, context, std::move(ticket), request.bus);
  if (!stream->open()) return nullptr;
  // The trace must not keep the stream alive that owns it.
  auto token = services.machine.bus_watch().trace(
      std::move(request), [weak = std::weak_ptr(stream), reply = services.reply](Result<TraceBatch> batch) {
        const auto shared = std::make_shared<Result<TraceBatch>>(std::move(batch));
        reply->post([weak, shared] {
          if (const auto self = weak.lock()) self->take(std::move(*shared));
        });
      });
  services.reply->post([stream, token = std::move(token)]() mutable {
    if (stream->ended()) return;
    stream->token_ = std::move(token);
    stream->go_on();
  });
  return stream.get();
}

void TraceStream::take(Result<TraceBatch> batch) {
  if (ended()) return;
  if (!batch) return end(to_status(batch.error()));
  waiting_ = *std::move(batch);
  go_on();
}

bool TraceStream::next(v1::TraceBusResponse& to) {
  const auto batch = std::exchange(waiting_, std::nullopt);
  if (!batch) {
    if (token_) token_->wanted.store(true, std::memory_order_release);
    return false;
  }
  to_proto(*batch, bus_, to);
  return true;
}

}  // namespace axisd::server
