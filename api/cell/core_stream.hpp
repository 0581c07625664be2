// Answering from the core.
#pragma once

#include <grpcpp/support/server_callback.h>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/post.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace axisd::cell {

/// A stream whose messages the core makes: the next one when the last one was taken, so that a slow reader
/// gets the newest. Thread: core, but for gRPC's reactions, which only post.
template <class Response>
class CoreStream final : public grpc::ServerWriteReactor<Response> {
 public:
  /// The next message; nothing: there is none yet.
  using Source = std::function<std::optional<Response>()>;

  /// To be made on gRPC's thread. `begin`: on the core, gives the source, or why there is none. `over`: when
  /// gRPC is done with it.
  static CoreStream* make(boost::asio::any_io_executor core, std::function<void()> over,
                          std::function<void(const std::shared_ptr<CoreStream>&)> begin) {
    std::shared_ptr<CoreStream> stream(new CoreStream(std::move(core), std::move(over)));
    stream->self_ = stream;
    boost::asio::post(stream->core_, [stream, begin = std::move(begin)] { begin(stream); });
    return stream.get();
  }

  void serve(Source source) {
    source_ = std::move(source);
    poke();
  }
  /// There may be another message.
  void poke() {
    if (state_ != State::idle || !source_) return;
    auto next = source_();
    if (!next) return;
    message_ = *std::move(next);
    state_ = State::writing;
    this->StartWrite(&message_);
  }
  void finish(const grpc::Status& status) {
    if (state_ == State::over) return;
    state_ = State::over;
    source_ = {};
    this->Finish(status);
  }

 private:
  enum class State : std::uint8_t { idle, writing, over };
  CoreStream(boost::asio::any_io_executor core, std::function<void()> over)
      : core_(std::move(core)), over_(std::move(over)) {}

  void OnWriteDone(bool ok) override {
    boost::asio::post(core_, [this, self = self_, ok] {
      if (state_ != State::writing) return;
      state_ = State::idle;
      if (ok)
        poke();
      else
        finish(grpc::Status::CANCELLED);
    });
  }
  void OnCancel() override {
    boost::asio::post(core_, [this, self = self_] { finish(grpc::Status::CANCELLED); });
  }
  void OnDone() override {
    if (over_) over_();
    boost::asio::post(core_, [self = std::move(self_)] {});
  }

  boost::asio::any_io_executor core_;
  const std::function<void()> over_;
  std::shared_ptr<CoreStream> self_;
  Source source_;
  Response message_;
  State state_ = State::idle;
};

/// The streams of one kind that are open. Thread: core.
template <class Response>
class CoreStreams {
 public:
  using Pointer = std::shared_ptr<CoreStream<Response>>;
  void add(const Pointer& stream) { streams_.push_back(stream); }
  void poke() {
    std::erase_if(streams_, [](const auto& stream) { return stream.expired(); });
    for (const auto& weak : std::vector(streams_))
      if (const auto stream = weak.lock()) stream->poke();
  }
  void finish(const grpc::Status& status) {
    for (const auto& weak : std::exchange(streams_, {}))
      if (const auto stream = weak.lock()) stream->finish(status);
  }

 private:
  std::vector<std::weak_ptr<CoreStream<Response>>> streams_;
};

}  // namespace axisd::cell
