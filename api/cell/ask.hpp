// Calls that the core makes: the answer comes on the core.
#pragma once

#include <google/protobuf/message_lite.h>
#include <grpcpp/channel.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/status.h>

#include <boost/asio/any_io_executor.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "buses/clock.hpp"

namespace axisd::cell {

using Metadata = std::vector<std::pair<std::string, std::string>>;

[[nodiscard]] grpc::ByteBuffer to_buffer(const google::protobuf::MessageLite& message);
/// False: it is no such message.
[[nodiscard]] bool from_buffer(const grpc::ByteBuffer& buffer, google::protobuf::MessageLite& message);

/// Calls of this file that are not over. Thread: core.
[[nodiscard]] int open_asks();

struct Question {
  std::string path;  ///< "/axisd.v1.SystemService/GetInfo"
  Duration timeout;
  Metadata metadata{};
};

/// Asks once. `done` is called later, once, on `core`. Thread: core.
void ask_bytes(boost::asio::any_io_executor core, const std::shared_ptr<grpc::Channel>& channel,
               const Question& question, grpc::ByteBuffer request,
               std::function<void(const grpc::Status&, const grpc::ByteBuffer&)> done);

/// For an answer as bytes: `done` gets the message. What cannot be read is an error.
template <class Response, class Done>
auto reading(Done done) {
  return [done = std::move(done)](const grpc::Status& status, const grpc::ByteBuffer& bytes) mutable {
    Response response;
    if (status.ok() && !from_buffer(bytes, response))
      return done(grpc::Status(grpc::StatusCode::INTERNAL, "the answer cannot be read"), response);
    done(status, response);
  };
}

/// The same with messages.
template <class Response, class Done>
void ask(boost::asio::any_io_executor core, const std::shared_ptr<grpc::Channel>& channel,
         const Question& question, const google::protobuf::MessageLite& request, Done done) {
  ask_bytes(std::move(core), channel, question, to_buffer(request), reading<Response>(std::move(done)));
}

/// A call in both directions that stays open. Thread: core.
class Talk : public std::enable_shared_from_this<Talk> {
 public:
  struct Events {
    std::function<void(const grpc::ByteBuffer&)> message;
    std::function<void(const grpc::Status&)> done;  ///< the last one
  };
  static std::shared_ptr<Talk> begin(boost::asio::any_io_executor core,
                                     const std::shared_ptr<grpc::Channel>& channel, const std::string& path,
                                     const Metadata& metadata, Events events);
  ~Talk();

  /// Behind what was said before.
  void say(const google::protobuf::MessageLite& message);
  /// From now on nothing is told any more.
  void end();

 private:
  class Reactor;
  Talk(boost::asio::any_io_executor core, Events events)
      : core_(std::move(core)), events_(std::move(events)) {}
  void on_said(bool ok);
  /// The other has nothing more to say, or is not listened to any more: the hold of this side goes.
  void on_silence();
  void on_message(const grpc::ByteBuffer& message);
  void on_done(const grpc::Status& status);
  void say_next();

  boost::asio::any_io_executor core_;
  Events events_;
  std::vector<grpc::ByteBuffer> waiting_;
  enum class Mouth : std::uint8_t { idle, speaking, last, shut } mouth_ = Mouth::idle;
  std::shared_ptr<Reactor> reactor_;
};

}  // namespace axisd::cell
