// A stream at the pace of its reader.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "api/server/reply_stream.hpp"
#include "api/server/status.hpp"
#include "devices/bus_watch.hpp"

namespace axisd::server {

/// Writes one message at a time, and tells the machine when it can take the next one: nothing is made for a
/// slow reader meanwhile. Thread: reply.
template <class Response, class Batch>
class PacedStream final : public ReplyStream<Response> {
 public:
  using Take = std::function<void(Result<Batch>)>;
  /// Begins the work; whatever it gives, it gives to `take`, on any thread.
  using Begin = std::function<std::shared_ptr<StreamToken>(Take take)>;
  using Convert = std::function<void(const Batch&, Response&)>;

  PacedStream(const Services& services, grpc::CallbackServerContext* context, Admission::Ticket ticket,
              Convert convert)
      : ReplyStream<Response>(services, context, std::move(ticket)), convert_(std::move(convert)) {}

  /// nullptr: the server is shutting down. Thread: gRPC.
  static grpc::ServerWriteReactor<Response>* start(const Services& services,
                                                   grpc::CallbackServerContext* context,
                                                   Admission::Ticket ticket, const Begin& begin,
                                                   Convert convert) {
    const auto stream =
        std::make_shared<PacedStream>(services, context, std::move(ticket), std::move(convert));
    if (!stream->open()) return nullptr;
    // The work must not keep the stream alive that owns it.
    auto token = begin([weak = std::weak_ptr(stream), reply = services.reply](Result<Batch> batch) {
      const auto shared = std::make_shared<Result<Batch>>(std::move(batch));
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

 private:
  bool next(Response& to) override {
    const auto batch = std::exchange(waiting_, std::nullopt);
    if (!batch) {
      if (token_) token_->wanted.store(true, std::memory_order_release);
      return false;
    }
    convert_(*batch, to);
    return true;
  }
  void release() override { token_.reset(); }
  void take(Result<Batch> batch) {
    if (this->ended()) return;
    if (!batch) return this->end(to_status(batch.error()));
    waiting_ = *std::move(batch);
    this->go_on();
  }

  const Convert convert_;
  std::shared_ptr<StreamToken> token_;
  std::optional<Batch> waiting_;  ///< not yet written
};

}  // namespace axisd::server
