#include "api/web/gateway/call.hpp"

#include <grpcpp/client_context.h>

#include <boost/asio/post.hpp>

namespace axisd::web {

/// What gRPC talks to: any of its threads. It has a hold on the call until the last read has failed, as reads
/// are asked for from outside of its reactions; without one the call would end between two of them.
class Call::Reactor final : public grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  Reactor(std::shared_ptr<Call> call, Request request) : call_(std::move(call)), request_(request.message) {
    for (const auto& [key, value] : request.metadata) context_.AddMetadata(key, value);
    if (request.timeout)
      context_.set_deadline(
          std::chrono::system_clock::now() +
          std::chrono::duration_cast<std::chrono::system_clock::duration>(*request.timeout));
    // Metadata, request and end in one: what comes behind on this connection cannot get between them.
    context_.set_initial_metadata_corked(true);
  }

  void start(grpc::GenericStub& stub, const std::string& path) {
    stub.PrepareBidiStreamingCall(&context_, path, {}, this);
    AddHold();
    StartWriteLast(&request_, {});
    StartRead(&response_);
    StartCall();
  }
  void read() { StartRead(&response_); }
  void cancel() { context_.TryCancel(); }
  [[nodiscard]] grpc::ByteBuffer take() {
    grpc::ByteBuffer taken;
    taken.Swap(&response_);
    return taken;
  }

 private:
  void OnReadDone(bool is_one) override {
    if (is_one)
      boost::asio::post(call_->executor_, [call = call_] { call->on_message(); });
    else
      RemoveHold();
  }
  void OnDone(const grpc::Status& status) override {
    // The call has this; it goes with the last who knows the call, which may be before this returns.
    auto call = std::move(call_);
    const auto executor = call->executor_;
    CallStatus ended{static_cast<int>(status.error_code()), status.error_message(), status.error_details()};
    boost::asio::post(executor, [call = std::move(call), ended = std::move(ended)]() mutable {
      call->on_done(std::move(ended));
    });
  }

  std::shared_ptr<Call> call_;
  grpc::ClientContext context_;
  grpc::ByteBuffer request_, response_;
};

Call::Call(boost::asio::any_io_executor executor, Events events, int& open)
    : executor_(std::move(executor)), events_(std::move(events)), open_(open) {
  ++open_;
}

Call::~Call() = default;

std::shared_ptr<Call> Call::start(boost::asio::any_io_executor executor, grpc::GenericStub& stub,
                                  Request request, Events events, int& open) {
  std::shared_ptr<Call> call(new Call(std::move(executor), std::move(events), open));
  const auto path = request.path;
  call->reactor_ = std::make_unique<Reactor>(call, std::move(request));
  call->reading_ = true;
  call->reactor_->start(stub, path);
  return call;
}

void Call::next() {
  if (reading_) return;
  reading_ = true;
  reactor_->read();
}

void Call::cancel() {
  if (std::exchange(cancelled_, true)) return;
  events_ = {};
  reactor_->cancel();
  next();  // so that a read fails, and the hold goes
}

void Call::leave(std::function<void()> over) {
  if (std::exchange(cancelled_, true)) return;
  events_ = {.message = {}, .done = [over = std::move(over)](const CallStatus&) { over(); }};
  next();
}

void Call::abort() { reactor_->cancel(); }

void Call::on_message() {
  reading_ = false;
  const auto message = reactor_->take();
  if (cancelled_)
    next();
  else
    events_.message(message);
}

void Call::on_done(CallStatus status) {
  --open_;
  reading_ = true;  // there is nothing more to be read
  const auto done = std::exchange(events_, {}).done;
  cancelled_ = true;
  if (done) done(std::move(status));
}

grpc::ByteBuffer to_buffer(std::string_view bytes) {
  const grpc::Slice slice(bytes.data(), bytes.size());
  return {&slice, 1};
}

void append(std::string& bytes, const grpc::ByteBuffer& buffer) {
  std::vector<grpc::Slice> slices;
  if (!buffer.Dump(&slices).ok()) return;
  for (const auto& slice : slices) bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
}

}  // namespace axisd::web
