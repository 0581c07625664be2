// A call that takes long and tells how far it is.
#pragma once

#include <memory>
#include <utility>

#include "api/server/reply_stream.hpp"
#include "api/server/status.hpp"

namespace axisd::server {

/// Writes the progress of one piece of work. Progress that comes while a write is pending is merged as
/// protobuf messages merge: single values replace, lists grow. So what waits is bounded by what the work can
/// find. Ending the call ends the work. Thread: reply.
template <class Response, class Progress>
class ProgressStream final : public ReplyStream<Response> {
 public:
  using ReplyStream<Response>::ReplyStream;
  using Callback = std::function<void(Result<Progress>)>;
  /// Starts the work; the returned token ends it.
  using Ask = std::function<std::shared_ptr<void>(Callback callback)>;
  /// Converts; true: this was the last one.
  using Convert = std::function<bool(const Progress& from, Response& to)>;

  /// nullptr: the server is shutting down. Thread: gRPC.
  static grpc::ServerWriteReactor<Response>* start(const Services& services,
                                                   grpc::CallbackServerContext* context,
                                                   Admission::Ticket ticket, const Ask& ask,
                                                   Convert convert) {
    const auto stream = std::make_shared<ProgressStream>(services, context, std::move(ticket));
    if (!stream->open()) return nullptr;
    stream->convert_ = std::move(convert);
    // The work must not keep the stream alive that owns it.
    auto work = ask([weak = std::weak_ptr(stream), reply = services.reply](Result<Progress> progress) {
      reply->post([weak, progress = std::move(progress)] {
        if (const auto self = weak.lock()) self->progressed(progress);
      });
    });
    services.reply->post([stream, work = std::move(work)]() mutable {
      if (!stream->ended()) stream->work_ = std::move(work);
    });
    return stream.get();
  }

 private:
  bool next(Response& to) override {
    if (!waiting_) return false;
    to = *std::exchange(waiting_, std::nullopt);
    return true;
  }
  void release() override { work_.reset(); }

  void progressed(const Result<Progress>& progress) {
    if (this->ended()) return;
    if (!progress) return this->end(to_status(progress.error()));
    Response response;
    const bool last = convert_(*progress, response);
    if (waiting_) {
      waiting_->MergeFrom(response);
    } else {
      waiting_ = std::move(response);
    }
    if (last) return this->end(grpc::Status::OK);
    this->go_on();
  }

  Convert convert_;
  std::shared_ptr<void> work_;
  std::optional<Response> waiting_;  ///< not yet written
};

}  // namespace axisd::server
