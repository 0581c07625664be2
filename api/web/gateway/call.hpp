// One call to the daemon, whose messages nobody parses.
#pragma once

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/support/byte_buffer.h>

#include <boost/asio/any_io_executor.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/web/gateway/grpc_web.hpp"
#include "buses/clock.hpp"

namespace axisd::web {

/// A call with one request and any number of answers. Unary calls are streams of one. Each answer is asked
/// for: who cannot take them has one waiting here at most, and the rest is the daemon's, which gives the
/// newest.
///
/// gRPC tells what happened on threads of its own, from there it is posted: nothing is told while something
/// is asked for. Thread: the executor's, which runs until the last call is over.
class Call : public std::enable_shared_from_this<Call> {
 public:
  struct Request {
    std::string path{};  ///< "/axisd.v1.AxisService/Stop"
    grpc::ByteBuffer message{};
    std::vector<std::pair<std::string, std::string>> metadata{};
    std::optional<Duration> timeout{};  ///< nothing: it may take for ever
  };
  struct Events {
    std::function<void(const grpc::ByteBuffer&)> message;  ///< next() asks for another
    std::function<void(CallStatus)> done;                  ///< the last event; next() was called before
  };
  /// Asks for the first message as well. `open`: counts calls that are not over; outlives them.
  static std::shared_ptr<Call> start(boost::asio::any_io_executor executor, grpc::GenericStub& stub,
                                     Request request, Events events, int& open);
  ~Call();

  /// Asks for the next message. Precondition: the last one has come.
  void next();
  /// From now on nothing is told any more. A command that was accepted is none the less executed.
  void cancel();
  /// The same, but that the call goes on to its end, of which `over` is told.
  void leave(std::function<void()> over);
  /// Ends it as soon as may be; what comes of that is told. What has not left here yet never will.
  void abort();

 private:
  class Reactor;
  Call(boost::asio::any_io_executor executor, Events events, int& open);
  void on_message();
  void on_done(CallStatus status);

  boost::asio::any_io_executor executor_;
  Events events_;
  int& open_;
  bool reading_ = false, cancelled_ = false;
  std::unique_ptr<Reactor> reactor_;
};

[[nodiscard]] grpc::ByteBuffer to_buffer(std::string_view bytes);
void append(std::string& bytes, const grpc::ByteBuffer& buffer);

}  // namespace axisd::web
