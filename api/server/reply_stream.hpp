// A server stream that waits for the core thread.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "api/server/services.hpp"
#include "api/server/stall_guard.hpp"
#include "buses/limited_log.hpp"

namespace axisd::server {

/// A stream that ends before it begins.
template <class Response>
class RefusedStream final : public grpc::ServerWriteReactor<Response> {
 public:
  explicit RefusedStream(const grpc::Status& status) { this->Finish(status); }
  void OnDone() override { delete this; }
};

/// Writes messages one at a time, as its source has them; what waits while a write is pending is up to the
/// source, which keeps it bounded. A reader that does not read is cancelled. Lives until gRPC is done with
/// it. Thread: reply, except where gRPC's threads call (On..., close()).
template <class Response>
class ReplyStream : public grpc::ServerWriteReactor<Response>,
                    public OpenCall,
                    public Stallable,
                    public std::enable_shared_from_this<ReplyStream<Response>> {
 public:
  ReplyStream(const Services& services, grpc::CallbackServerContext* context, Admission::Ticket ticket)
      : reply_(services.reply),
        calls_(services.calls),
        guard_(services.guard),
        judge_(services.callers.judge_of(*context)),
        context_(context),
        ticket_(std::move(ticket)) {}

  /// Takes gRPC's share of the stream. False: the server is shutting down, the stream must not begin.
  /// Thread: gRPC.
  [[nodiscard]] bool open() {
    if (!calls_->add(this->shared_from_this(), context_->peer(), std::move(judge_))) return false;
    self_ = this->shared_from_this();
    return true;
  }

  /// Ends it without what is still to be written. Thread: any.
  void close(const grpc::Status& status) final {
    reply_->post([stream = this->shared_from_this(), status] {
      stream->closing_ = true;
      stream->end(status);
    });
  }

  [[nodiscard]] std::optional<TimePoint> writing_since() const final { return write_began_; }
  [[nodiscard]] bool closing() const final { return closing_; }
  void cancel() final {
    if (finished_) return;
    log_limited(spdlog::level::warn, ticket_.client(), "streams",
                fmt::format("{} stopped reading its stream: cancelled", context_->peer()));
    context_->TryCancel();
  }

  void OnWriteDone(bool ok) final {
    reply_->post([stream = this->shared_from_this(), ok] {
      stream->write_began_.reset();
      if (ok) return stream->go_on();
      stream->closing_ = true;
      stream->end(grpc::Status::CANCELLED);
    });
  }
  void OnCancel() final { close(grpc::Status::CANCELLED); }
  void OnDone() final {
    calls_->remove(this);
    const auto last = std::move(self_);  // may end this object, after this function
  }

 protected:
  /// Fills the (empty) message to write next. False: there is none now.
  virtual bool next(Response& to) = 0;
  /// Lets go of the source. Once, before the stream finishes.
  virtual void release() = 0;

  [[nodiscard]] bool ended() const { return finished_ || end_with_; }
  [[nodiscard]] ReplyThread& reply() { return *reply_; }

  /// Ends the stream once everything was written. The first status counts.
  void end(const grpc::Status& status) {
    if (!end_with_) end_with_ = status;
    go_on();
  }

  /// Writes what the source has, unless a write is pending.
  void go_on() {
    if (write_began_ || finished_) return;
    response_.Clear();
    if (closing_ || !next(response_)) {
      if (end_with_) finish();
      return;
    }
    write_began_ = monotonic_now();
    guard_->watch(this->weak_from_this());
    this->StartWrite(&response_);
  }

 private:
  void finish() {
    finished_ = true;
    release();
    ticket_.release();
    calls_->answered(this);
    this->Finish(*end_with_);
  }

  const std::shared_ptr<ReplyThread> reply_;
  const std::shared_ptr<OpenCalls> calls_;
  const std::shared_ptr<StallGuard> guard_;
  OpenCalls::Judge judge_;                      ///< until open()
  grpc::CallbackServerContext* const context_;  ///< valid until Finish was called
  Admission::Ticket ticket_;
  Response response_;                     ///< of the pending write
  std::optional<TimePoint> write_began_;  ///< set while a write is pending
  bool closing_ = false;                  ///< nothing more is written
  bool finished_ = false;
  std::optional<grpc::Status> end_with_;  ///< once everything was written
  std::shared_ptr<ReplyStream> self_;     ///< gRPC's share, until OnDone
};

}  // namespace axisd::server
