#include "api/cell/ask.hpp"

#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <grpcpp/client_context.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/support/client_callback.h>
#include <grpcpp/support/slice.h>

#include <boost/asio/post.hpp>

namespace axisd::cell {
namespace {

int open_now = 0;

}  // namespace

int open_asks() { return open_now; }

grpc::ByteBuffer to_buffer(const google::protobuf::MessageLite& message) {
  const grpc::Slice slice(message.SerializeAsString());
  return {&slice, 1};
}

bool from_buffer(const grpc::ByteBuffer& buffer, google::protobuf::MessageLite& message) {
  grpc::Slice whole;
  if (buffer.TrySingleSlice(&whole).ok())
    return message.ParseFromArray(whole.begin(), static_cast<int>(whole.size()));
  if (!buffer.Valid() || !buffer.DumpToSingleSlice(&whole).ok()) return false;
  return message.ParseFromArray(whole.begin(), static_cast<int>(whole.size()));
}

void ask_bytes(boost::asio::any_io_executor core, const std::shared_ptr<grpc::Channel>& channel,
               const Question& question, grpc::ByteBuffer request,
               std::function<void(const grpc::Status&, const grpc::ByteBuffer&)> done) {
  struct Asked {
    Asked(const std::shared_ptr<grpc::Channel>& to, grpc::ByteBuffer message)
        : stub(to), request(std::move(message)) {}
    grpc::GenericStub stub;
    grpc::ClientContext context;
    grpc::ByteBuffer request, response;
  };
  auto asked = std::make_shared<Asked>(channel, std::move(request));
  for (const auto& [key, value] : question.metadata) asked->context.AddMetadata(key, value);
  asked->context.set_deadline(
      std::chrono::system_clock::now() +
      std::chrono::duration_cast<std::chrono::system_clock::duration>(question.timeout));
  auto* const own = asked.get();
  ++open_now;
  own->stub.UnaryCall(
      &own->context, question.path, {}, &own->request, &own->response,
      [core = std::move(core), asked = std::move(asked), done = std::move(done)](grpc::Status status) {
        boost::asio::post(core, [asked, done, status = std::move(status)] {
          --open_now;
          done(status, asked->response);
        });
      });
}

/// What gRPC talks to: any of its threads. A hold until the last read has failed, and one while the core may
/// still say something: without them the call would end between two of these.
class Talk::Reactor final : public grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  explicit Reactor(std::shared_ptr<Talk> talk) : talk_(std::move(talk)) {}

  void begin(const std::shared_ptr<grpc::Channel>& channel, const std::string& path, const Metadata& metadata,
             std::shared_ptr<Reactor> self) {
    self_ = std::move(self);
    stub_.emplace(channel);
    for (const auto& [key, value] : metadata) context_.AddMetadata(key, value);
    stub_->PrepareBidiStreamingCall(&context_, path, {}, this);
    AddMultipleHolds(2);
    StartRead(&response_);
    StartCall();
  }
  void say(const grpc::ByteBuffer& message) {
    request_ = message;
    StartWrite(&request_);
  }
  /// Nothing is said any more.
  void shut() { RemoveHold(); }
  void cancel() { context_.TryCancel(); }

 private:
  void OnWriteDone(bool ok) override {
    boost::asio::post(talk_->core_, [talk = talk_, ok] { talk->on_said(ok); });
  }
  void OnReadDone(bool ok) override {
    if (!ok) {
      boost::asio::post(talk_->core_, [talk = talk_] { talk->on_silence(); });
      return RemoveHold();
    }
    boost::asio::post(talk_->core_, [talk = talk_, message = response_] { talk->on_message(message); });
    response_.Clear();
    StartRead(&response_);
  }
  void OnDone(const grpc::Status& status) override {
    boost::asio::post(talk_->core_, [self = std::move(self_), status] {
      const auto talk = std::move(self->talk_);
      talk->on_done(status);
    });
  }

  std::shared_ptr<Talk> talk_;
  std::shared_ptr<Reactor> self_;
  std::optional<grpc::GenericStub> stub_;
  grpc::ClientContext context_;
  grpc::ByteBuffer request_, response_;
};

Talk::~Talk() = default;

std::shared_ptr<Talk> Talk::begin(boost::asio::any_io_executor core,
                                  const std::shared_ptr<grpc::Channel>& channel, const std::string& path,
                                  const Metadata& metadata, Events events) {
  std::shared_ptr<Talk> talk(new Talk(std::move(core), std::move(events)));
  ++open_now;
  talk->reactor_ = std::make_shared<Reactor>(talk);
  talk->reactor_->begin(channel, path, metadata, talk->reactor_);
  return talk;
}

void Talk::say(const google::protobuf::MessageLite& message) {
  if (mouth_ == Mouth::shut || mouth_ == Mouth::last) return;
  waiting_.push_back(to_buffer(message));
  if (mouth_ == Mouth::idle) say_next();
}

void Talk::say_next() {
  const auto message = std::move(waiting_.front());
  waiting_.erase(waiting_.begin());
  mouth_ = Mouth::speaking;
  reactor_->say(message);
}

void Talk::on_said(bool ok) {
  if (!ok || mouth_ == Mouth::last) {
    mouth_ = Mouth::shut;
    return reactor_->shut();
  }
  mouth_ = Mouth::idle;
  if (!waiting_.empty()) say_next();
}

void Talk::on_silence() {
  if (mouth_ == Mouth::speaking) mouth_ = Mouth::last;
  if (mouth_ != Mouth::idle) return;
  mouth_ = Mouth::shut;
  reactor_->shut();
}

void Talk::end() {
  if (!events_.message && !events_.done) return;
  events_ = {};
  if (!reactor_) return;
  reactor_->cancel();
  on_silence();
}

void Talk::on_message(const grpc::ByteBuffer& message) {
  if (events_.message) events_.message(message);
}

void Talk::on_done(const grpc::Status& status) {
  --open_now;
  mouth_ = Mouth::shut;
  reactor_.reset();
  const auto done = std::exchange(events_, {}).done;
  if (done) done(status);
}

}  // namespace axisd::cell
